import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type Check, ProblemError, type Schemas } from "../../lib/api/client";
import { type LiveState, store } from "../../lib/live/store";
import type * as links from "../../ui/links";
import { ME } from "../auth/testUsers";
import { PATIENT } from "./session-wizard/examples";
import { TeachPanel } from "./TeachPanel";

vi.mock("../../ui/links", async (original) => ({
  ...(await original<typeof links>()),
  PageLink: ({ children }: { children: ReactNode }) => <a href="/">{children}</a>,
}));

const check = (name: Check["check"], subject: string, given: boolean, detected = false): Check => ({
  check: name,
  subject,
  sentence: `About the ${name}.`,
  detected,
  given,
  checked_by: given && !detected ? ME.name : null,
  checked_at: given ? "2026-11-21T09:10:00Z" : null,
});
const PEDAL = check("pedal", "", true, true);
const ESTOP = check("estop", "", true, true);
const LOOKED_AT = [
  check("side", "left", false),
  check("fixtures", "arm_fixer_1", false),
  check("belt", "", false),
];

function show(checks: Check[]) {
  vi.spyOn(api, "teachingChecklist").mockResolvedValue({
    patient: PATIENT,
    checks,
    complete: checks.every(({ given }) => given),
  });
  const live = { device: "running", age_ms: 5, mode: "idle", refusals: {}, teaching: null };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  vi.spyOn(store, "waitForFreshState").mockResolvedValue();
  const teach = vi.spyOn(api, "teach").mockResolvedValue({ teaching_id: "t" });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        <TeachPanel patientId="p" />
      </QueryClientProvider>
    </MantineProvider>,
  );
  return teach;
}

const enabled = async (name: string) => {
  const button = await screen.findByRole("button", { name });
  await waitFor(() => expect(button.hasAttribute("disabled")).toBe(false));
  return button;
};

beforeEach(() => {
  vi.restoreAllMocks();
});
afterEach(cleanup);

describe("before teaching", () => {
  it("one press confirms the open checks and starts", async () => {
    const teach = show([...LOOKED_AT, PEDAL, ESTOP]);
    fireEvent.click(await enabled("Confirm all 3 checks and start teaching"));
    await waitFor(() =>
      expect(teach).toHaveBeenCalledWith({
        patient_id: "p",
        name: "Motion",
        taught_by: ME.name,
        side: "left",
        fixtures: ["arm_fixer_1"],
        looked_at: ["side", "fixtures", "belt"],
      }),
    );
  });

  it("asks only for open checks but always names the fixtures", async () => {
    const [side, fixtures, belt] = LOOKED_AT.map((check) => ({ ...check, given: true }));
    if (!side || !fixtures || !belt) throw new Error("none");
    const teach = show([side, fixtures, belt, PEDAL, ESTOP]);
    fireEvent.click(await enabled("Start teaching"));
    await waitFor(() => expect(teach).toHaveBeenCalledWith(expect.objectContaining({ looked_at: [] })));
    const list = within(screen.getByRole("region", { name: "Checks before teaching" }));
    expect(list.getByText("About the fixtures.")).toBeTruthy();
    expect(list.queryByText("About the belt.")).toBeNull();
  });

  it("cannot confirm what the apparatus must detect", async () => {
    show([...LOOKED_AT, PEDAL, { ...ESTOP, given: false }]);
    expect((await screen.findByTestId("check-estop")).textContent).toContain(
      "Not detected yet. Press the switch",
    );
    const button = screen.getByRole("button", { name: "Confirm all 3 checks and start teaching" });
    expect(button.hasAttribute("disabled")).toBe(true);
  });

  it("starts only after two identifiers agree", async () => {
    const teach = show([check("identity", "", false), ...LOOKED_AT, PEDAL, ESTOP]);
    const start = await screen.findByRole("button", { name: "Confirm all 3 checks and start teaching" });
    fireEvent.click(await screen.findByRole("checkbox", { name: /Stated name/ }));
    expect(start.hasAttribute("disabled")).toBe(true);
    fireEvent.click(screen.getByRole("checkbox", { name: "Clinic number: K-1" }));
    fireEvent.click(await enabled("Confirm all 3 checks and start teaching"));
    await waitFor(() =>
      expect(teach).toHaveBeenCalledWith(expect.objectContaining({ identifiers: ["name", "clinic_number"] })),
    );
  });

  it("asks for the checks again when the apparatus misses one", async () => {
    // The apparatus was turned after the test of its switch.
    const teach = show([...LOOKED_AT, PEDAL, ESTOP]);
    teach.mockRejectedValue(new ProblemError({ detail: "These checks are not complete yet." }));
    const start = await enabled("Confirm all 3 checks and start teaching");
    vi.spyOn(api, "teachingChecklist").mockResolvedValue({
      patient: PATIENT,
      checks: [...LOOKED_AT, PEDAL, { ...ESTOP, given: false }],
      complete: false,
    });
    fireEvent.click(start);
    expect(await screen.findByTestId("check-estop")).toBeTruthy();
  });

  it("forgets a refusal when the apparatus has been turned", async () => {
    const teach = show([...LOOKED_AT, PEDAL, ESTOP]);
    teach.mockRejectedValue(new ProblemError({ detail: "It is set up for the right shoulder." }));
    fireEvent.click(await enabled("Confirm all 3 checks and start teaching"));
    await screen.findByText(/set up for the right shoulder/);
    const { live, ...state } = store.get();
    vi.spyOn(store, "get").mockReturnValue({ ...state, live: { ...live, side: "left" } } as LiveState);
    fireEvent.change(screen.getByLabelText("Name of the motion"), { target: { value: "Lift" } });
    await waitFor(() => expect(screen.queryByText(/set up for the right shoulder/)).toBeNull());
  });

  it("asks for the checks again when the apparatus has been turned", async () => {
    show([...LOOKED_AT, PEDAL, ESTOP]);
    await enabled("Confirm all 3 checks and start teaching");
    const { live, ...state } = store.get();
    vi.spyOn(store, "get").mockReturnValue({ ...state, live: { ...live, side: "left" } } as LiveState);
    fireEvent.change(screen.getByLabelText("Name of the motion"), { target: { value: "Lift" } });
    await waitFor(() => expect(api.teachingChecklist).toHaveBeenCalledTimes(2));
  });

  it("asks for the chosen fixtures", async () => {
    const teach = show([...LOOKED_AT, PEDAL, ESTOP]);
    await enabled("Confirm all 3 checks and start teaching");
    fireEvent.click(screen.getByLabelText("Arm fixer 2 and elbow fixer 1 (motion 6)"));
    await waitFor(() =>
      expect(api.teachingChecklist).toHaveBeenLastCalledWith("p", ["arm_fixer_2", "elbow_fixer_1"]),
    );
    fireEvent.click(await enabled("Confirm all 3 checks and start teaching"));
    await waitFor(() =>
      expect(teach).toHaveBeenCalledWith(
        expect.objectContaining({ fixtures: ["arm_fixer_2", "elbow_fixer_1"] }),
      ),
    );
  });
});

it("lists the takes that were saved while the connection was lost", async () => {
  const live = { device: "running", age_ms: 5, mode: "teaching", refusals: {} };
  const teaching = { teaching_id: "t", takes: 2, take_s: 0, recording: false, released_once: true };
  const state = { connected: true, heardAt: 0, station: null, live: { ...live, teaching }, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  const onReconnected = vi.spyOn(store, "onReconnected");
  const take = (id: string, teaching_id: string | null, number: number | null) =>
    ({ id, name: `Take ${id}`, teaching_id, take: number, duration_s: 3 }) as Schemas["Recording"];
  vi.spyOn(api, "recordings").mockResolvedValue({
    items: [take("b", "t", 2), take("a", "t", 1), take("c", "earlier", 1), take("d", null, null)],
  });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TeachPanel patientId="p" />
      </QueryClientProvider>
    </MantineProvider>,
  );
  expect(screen.queryByTestId("saved")).toBeNull();
  onReconnected.mock.calls.at(-1)?.[0]();
  const names = within(await screen.findByTestId("saved")).getAllByRole("link");
  expect(names.map(({ textContent }) => textContent)).toEqual(["Take a", "Take b"]);
});
