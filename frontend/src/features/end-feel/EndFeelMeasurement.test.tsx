import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { forgetDrafts } from "../../lib/draft";
import { type LiveState, store } from "../../lib/live/store";
import { HOLD_MS } from "../../safety/useHold";
import { EndFeelMeasurement } from "./EndFeelMeasurement";

type Motion = Schemas["EndFeelMotion"];
const motion = (given: Partial<Motion>): Motion => ({
  recording_id: "a",
  recording_name: "Lift",
  motion: 4,
  name: "Abduction / adduction of the shoulder",
  motor: 3,
  side: "right",
  baseline_run_id: null,
  end_deg: 95,
  tests: [],
  stretches: [],
  ...given,
});

function show(motions: Motion[], level: number | null = 20) {
  vi.spyOn(api, "checklist").mockResolvedValue({ complete: true, checks: [] } as never);
  vi.spyOn(api, "endFeelGuide").mockResolvedValue({ speed_deg_s: 5, motions });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <EndFeelMeasurement session={{ id: "s" } as Session} level={level} />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

function becomes(mode: string, run: object | null) {
  const live = { device: "running", age_ms: 5, mode, stop: null, run, refusals: {}, stops: 0, at: "now" };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
}

async function hold(name: string) {
  const button = await screen.findByRole("button", { name });
  vi.useFakeTimers();
  fireEvent.pointerDown(button, { button: 0, isPrimary: true });
  await act(async () => vi.advanceTimersByTime(HOLD_MS + 50));
  vi.useRealTimers();
}

beforeEach(() => {
  becomes("idle", null);
  vi.spyOn(store, "waitForFreshState").mockResolvedValue();
});
afterEach(() => {
  cleanup();
  forgetDrafts();
  vi.restoreAllMocks();
});

it("offers the baseline first, and the test after it", async () => {
  show([
    motion({}),
    motion({ recording_id: "b", motion: 6, baseline_run_id: "base" }),
    motion({ recording_id: "c" }),
  ]);
  expect(await screen.findAllByTestId("end-feel-motion")).toHaveLength(2);
  expect(screen.getByRole("button", { name: "Hold to measure the baseline" })).toBeTruthy();
  expect(screen.getByRole("button", { name: "Move to the start of the test" })).toBeTruthy();
  expect(screen.getByText(/tried in simulation only/)).toBeTruthy();
});

it("measures a baseline again, with another weight", async () => {
  show([motion({ baseline_run_id: "base" })]);
  fireEvent.click(await screen.findByRole("button", { name: "Measure the baseline again" }));
  expect(screen.getByText(/as heavy as the arm.* replaces the one of today/)).toBeTruthy();
  expect(screen.getByRole("button", { name: "Hold to measure the baseline" })).toBeTruthy();
  expect(screen.queryByRole("button", { name: "Move to the start of the test" })).toBeNull();
  fireEvent.click(screen.getByRole("button", { name: "Keep the baseline of today" }));
  expect(screen.getByRole("button", { name: "Move to the start of the test" })).toBeTruthy();
});

it.each([
  ["test", "base", "Move to the start of the test"],
  ["baseline", null, "Hold to measure the baseline"],
] as const)(
  "one hold loads a %s and moves to its start, and begins nothing",
  async (kind, baseline, name) => {
    const seen = { stops: 3, seen_at: "when pressed" };
    vi.spyOn(store, "seen").mockReturnValueOnce(seen).mockReturnValue({ stops: 4, seen_at: "later" });
    const load = vi.spyOn(api, "loadEndFeel").mockResolvedValue({ id: "r" } as Schemas["Run"]);
    const approach = vi.spyOn(api, "approach").mockResolvedValue({ accepted: true });
    const play = vi.spyOn(api, "play").mockResolvedValue({ accepted: true });
    show([motion({ baseline_run_id: baseline })]);
    await screen.findByRole("button", { name });
    load.mockImplementation(async () => {
      // The user lets go while the service loads.
      fireEvent.pointerUp(document.body);
      becomes("ready", { run_id: "r" });
      return { id: "r" } as Schemas["Run"];
    });
    await hold(name);
    await waitFor(() => expect(approach).toHaveBeenCalledTimes(1));
    expect(approach).toHaveBeenCalledWith(seen);
    expect(load).toHaveBeenCalledWith({
      session_id: "s",
      recording_id: "a",
      kind,
      torque_nm: 1.5,
      resistance_level: 20,
      speed_deg_s: 5,
      hold_s: 30,
      repetitions: 3,
      largest_deg: null,
    });
    expect(play).not.toHaveBeenCalled();
  },
);

it("loads a stretch with its hold time, repetitions and largest angle", async () => {
  vi.spyOn(store, "seen").mockReturnValue({ stops: 3, seen_at: "when pressed" });
  const load = vi.spyOn(api, "loadEndFeel").mockResolvedValue({ id: "r" } as Schemas["Run"]);
  show([motion({ baseline_run_id: "base" })]);
  const name = "Move to the start of the stretch";
  const button = await screen.findByRole("button", { name });
  fireEvent.change(screen.getByLabelText("Hold time, s"), { target: { value: "" } });
  expect((button as HTMLButtonElement).disabled).toBe(true);
  fireEvent.change(screen.getByLabelText("Hold time, s"), { target: { value: "20" } });
  fireEvent.change(screen.getByLabelText("Largest angle, °"), { target: { value: "90" } });
  await hold(name);
  await waitFor(() => expect(load).toHaveBeenCalledTimes(1));
  expect(load.mock.calls[0]?.[0]).toMatchObject({
    kind: "stretch",
    hold_s: 20,
    repetitions: 3,
    largest_deg: 90,
  });
});

it("says for how long a stretch was held", async () => {
  const stretch = { hold_s: 30, repetitions: 3, largest_deg: 110, held_s: 84.3, target_nm: 1.2 };
  show([
    motion({
      baseline_run_id: "base",
      stretches: [{ run_id: "s", stretch } as unknown as Schemas["EndFeelRecord"]],
    }),
  ]);
  expect((await screen.findByTestId("stretch-last")).textContent).toContain(
    "Held for 1\u00a0min 24\u00a0s with at least 60\u00a0% of 1.2\u00a0Nm",
  );
});

it("names what is missing before a measurement", async () => {
  show([motion({})], null);
  const button = await screen.findByRole("button", { name: "Hold to measure the baseline" });
  expect((button as HTMLButtonElement).disabled).toBe(true);
  expect(screen.getByText("Choose a resistance level first.")).toBeTruthy();
  fireEvent.change(screen.getByLabelText("Chosen torque, Nm"), { target: { value: "" } });
  expect(screen.getByText("Enter a torque of 0.3 to 4 Nm.")).toBeTruthy();
});

it("says why a test has no figures", async () => {
  const test = { run_id: "t", outcome: "completed", unmeasured: "guarding", figures: null, interval: null };
  show([motion({ baseline_run_id: "base", tests: [test as unknown as Schemas["EndFeelRecord"]] })]);
  expect((await screen.findByTestId("end-feel-last")).textContent).toContain(
    "worked with or against the apparatus",
  );
});

it("does not replace a torque above the range by the largest one", async () => {
  show([motion({})]);
  const torque = await screen.findByLabelText("Chosen torque, Nm");
  fireEvent.change(torque, { target: { value: "15" } });
  fireEvent.blur(torque);
  expect((torque as HTMLInputElement).value).toBe("15");
  expect(screen.getByText("Enter a torque of 0.3 to 4 Nm.")).toBeTruthy();
  const button = screen.getByRole("button", { name: "Hold to measure the baseline" });
  expect((button as HTMLButtonElement).disabled).toBe(true);
});

it("does not replace a hold time above the range by the longest one", async () => {
  show([motion({ baseline_run_id: "base" })]);
  const time = await screen.findByLabelText("Hold time, s");
  fireEvent.change(time, { target: { value: "300" } });
  fireEvent.blur(time);
  expect((time as HTMLInputElement).value).toBe("300");
  const button = screen.getByRole("button", { name: "Move to the start of the stretch" });
  expect((button as HTMLButtonElement).disabled).toBe(true);
});

it("gives one hint how long to hold the button of a baseline", async () => {
  show([motion({})]);
  expect(await screen.findByText(/^Hold the button until the baseline begins/)).toBeTruthy();
  expect(screen.queryByText("Hold for one second. The arm will move.")).toBeNull();
});
