import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider, useQuery } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, ProblemError, type Programme, type ProgrammeItem } from "../../lib/api/client";
import { forgetDrafts } from "../../lib/draft";
import { AS_TAUGHT } from "../station/playSettingsModel";
import { ProgrammeView } from "./ProgrammePage";

const item = (position: number, name: string): ProgrammeItem => ({
  ...AS_TAUGHT,
  position,
  recording_id: name,
  recording_name: name,
  recording_archived: false,
  duration_s: 30,
  resistance_level: 8,
  self_paced: false,
});
const FIRST = {
  id: "v1",
  number: 1,
  made_at: "2026-11-20T09:30:00Z",
  made_by: "Aoki",
  note: "To begin with.",
  timer_minutes: null,
  sessions_per_week: null,
  duration_s: 60,
  items: [item(1, "Lift"), item(2, "Turn")],
};
const SECOND = {
  ...FIRST,
  id: "v2",
  number: 2,
  made_by: "Baba",
  note: "Too much.",
  items: [item(1, "Turn")],
};
const PROGRAMME: Programme = {
  id: "p",
  episode_id: "e",
  name: "Morning",
  side: "right",
  archived_at: null,
  updated_at: "2026-11-20T09:30:00Z",
  patient: { id: "who", name: "Mori Sakura" },
  closed: false,
  current: FIRST,
  versions: [FIRST],
};
const CHANGED: Programme = { ...PROGRAMME, current: SECOND, versions: [SECOND, FIRST] };

const saved = vi.spyOn(api, "createProgrammeVersion");
const preview = vi.spyOn(api, "previewProgramme");

beforeEach(() => {
  vi.resetAllMocks();
  vi.spyOn(api, "recordings").mockResolvedValue({ items: [] });
  vi.spyOn(api, "episodes").mockResolvedValue({ items: [], next: null });
  vi.spyOn(api, "patient").mockResolvedValue({ affected_side: "right" } as never);
  preview.mockImplementation(async (_, { items }) => ({
    duration_s: 30 * items.length,
    items: items.map(() => ({ duration_s: 30, problem: null })),
  }));
});
afterEach(() => {
  cleanup();
  forgetDrafts();
});

function Held() {
  const held = useQuery({ queryKey: ["programme", "p"], queryFn: () => PROGRAMME, initialData: PROGRAMME });
  return <ProgrammeView programme={held.data} />;
}

function show() {
  const client = new QueryClient({ defaultOptions: { queries: { staleTime: Number.POSITIVE_INFINITY } } });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={client}>
        <TestRouter>
          <Held />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
}
const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));
const names = () =>
  within(screen.getByRole("table", { name: "Recordings in playing order" }))
    .getAllByRole("row")
    .slice(1)
    .map((row) => within(row).getAllByRole("cell")[1]?.textContent);

// Queries by role are slow on a whole page on a busy computer.
describe("a programme", { timeout: 30_000 }, () => {
  it("gets a new version with order, settings, timer and reason", async () => {
    saved.mockResolvedValue(CHANGED);
    show();
    press("Change");
    press("Turn: move up");
    expect(names()).toEqual(["Turn", "Lift"]);
    expect(screen.getByText("Turn is now number 1 of 2.")).toBeTruthy();
    press("Lift: settings");
    press("Range: decrease");
    press("One level lower");
    press("Done");
    fireEvent.click(screen.getByRole("switch", { name: "With timer" }));
    fireEvent.change(screen.getByRole("textbox", { name: "Reason" }), { target: { value: "It hurt." } });
    expect((await screen.findByTestId("whole")).textContent).toBeTruthy();
    press("Save as version 2");
    await waitFor(() => expect(saved).toHaveBeenCalled());
    const asked = { ...AS_TAUGHT, resistance_level: 8, end_range: null, self_paced: false };
    expect(saved.mock.calls).toEqual([
      [
        "p",
        {
          based_on: 1,
          made_by: "Ito Mai",
          note: "It hurt.",
          timer_minutes: 20,
          sessions_per_week: null,
          items: [
            { ...asked, recording_id: "Turn" },
            { ...asked, recording_id: "Lift", range_percent: 95, resistance_level: 7 },
          ],
        },
      ],
    ]);
    // The previous version stays in the list, with its changes.
    await waitFor(() => expect(screen.queryByRole("button", { name: "Save as version 2" })).toBeNull());
    expect(screen.getByTestId("changes-2").textContent).toBe("Lift removed");
    expect(screen.getByText("To begin with.")).toBeTruthy();
  });

  it("keeps the focus on a moved item's buttons", () => {
    show();
    press("Change");
    press("Lift: move down");
    expect(document.activeElement?.getAttribute("aria-label")).toBe("Lift: move up");
    press("Lift: remove");
    expect(names()).toEqual(["Turn"]);
  });

  it("shows durations and what cannot be played", async () => {
    preview.mockResolvedValue({
      duration_s: 30,
      items: [
        { duration_s: 30, problem: null },
        { duration_s: null, problem: "Item 2 cannot be played with these settings: motor 3 is too fast." },
      ],
    });
    show();
    press("Change");
    expect((await screen.findByRole("alert")).textContent).toContain("motor 3 is too fast");
    expect(screen.getByTestId("whole").textContent).toBe("Total playing time 30\u00a0s");
    expect(screen.getByRole("button", { name: "Save as version 2" }).hasAttribute("disabled")).toBe(true);
  });

  it("keeps the input when another user saved first", async () => {
    saved.mockRejectedValueOnce(
      new ProblemError({ code: "edited_meanwhile", detail: "Somebody else has changed this programme." }),
    );
    vi.spyOn(api, "programme").mockResolvedValue(CHANGED);
    show();
    press("Change");
    press("Turn: move up");
    press("Save as version 2");
    expect(await screen.findByText(/Baba has saved version 2 in the meantime/)).toBeTruthy();
    expect(screen.getByText("Too much.")).toBeTruthy();
    expect(names()).toEqual(["Turn", "Lift"]);
    saved.mockResolvedValue(CHANGED);
    press("I have read version 2: save my changes as the next version");
    press("Save as version 3");
    await waitFor(() => expect(saved.mock.calls.at(-1)?.[1].based_on).toBe(2));
  });

  it("of a closed episode is read-only", () => {
    vi.spyOn(api, "programme").mockResolvedValue(PROGRAMME);
    render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <TestRouter>
            <ProgrammeView programme={{ ...PROGRAMME, closed: true }} />
          </TestRouter>
        </QueryClientProvider>
      </MantineProvider>,
    );
    expect(screen.queryByRole("button", { name: "Change" })).toBeNull();
    expect(screen.getByText(/episode of care is closed/)).toBeTruthy();
  });
});
