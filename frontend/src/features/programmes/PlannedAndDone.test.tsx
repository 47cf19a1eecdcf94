import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen, waitFor, within } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Schemas } from "../../lib/api/client";
import { AS_TAUGHT } from "../station/playSettingsModel";
import { PlannedAndDone } from "./PlannedAndDone";

afterEach(cleanup);

const RUN: Schemas["PlannedRun"] = {
  ...AS_TAUGHT,
  run_id: "r",
  recording_id: "Lift",
  recording_name: "Lift",
  started_at: "2026-11-21T09:30:00Z",
  outcome: "completed",
  repetitions: 10,
  resistance_level: 8,
  self_paced: false,
  least_range_percent: null,
  repetitions_done: 10,
  changed: [],
};
const ITEM: Schemas["ItemDone"] = {
  ...AS_TAUGHT,
  position: 1,
  recording_id: "Lift",
  recording_name: "Lift",
  recording_archived: false,
  duration_s: 60,
  repetitions: 10,
  resistance_level: 8,
  self_paced: false,
  runs: [RUN],
  repetitions_done: 10,
  done: "all",
};
const PLAN: Schemas["SessionPlan"] = {
  session_id: "s",
  ended: true,
  programme: { id: "p", name: "Morning", version_id: "v", number: 2, duration_s: 120 },
  items: [ITEM],
  besides: [],
  repetitions_planned: 10,
  repetitions_done: 10,
  played_s: 61,
  timer: null,
};

function show(plan: Schemas["SessionPlan"]) {
  const asked = vi.spyOn(api, "sessionPlan").mockResolvedValue(plan);
  const { container } = render(
    <MantineProvider>
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>
          <PlannedAndDone sessionId="s" />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
  return { asked, container };
}

it("shows done, changed and omitted items", async () => {
  const broken = {
    ...RUN,
    outcome: "stopped" as const,
    repetitions_done: 4,
    range_percent: 80,
    changed: ["range_percent" as const],
    least_range_percent: 60,
  };
  show({
    ...PLAN,
    items: [
      ITEM,
      { ...ITEM, position: 2, runs: [broken], repetitions_done: 4, done: "some" },
      { ...ITEM, position: 3, recording_name: "Turn", runs: [], repetitions_done: 0, done: "none" },
    ],
    besides: [{ ...RUN, recording_name: "Reach", resistance_level: null }],
    repetitions_planned: 30,
    repetitions_done: 14,
    timer: { minutes: 1, played_s: 61, left_s: 0 },
  });
  const rows = within(await screen.findByTestId("planned")).getAllByRole("row");
  const cells = (row: number) =>
    within(rows[row] as HTMLElement)
      .getAllByRole("cell")
      .filter((_, place) => place === 2 || place === 4)
      .map((cell) => cell.textContent);
  expect(cells(1)).toEqual(["10\u00a0of\u00a010", "–"]);
  expect(cells(2)).toEqual([
    "4\u00a0of\u00a010",
    "stopped, range 80\u00a0% instead of 100\u00a0%, range reduced during playback, down to 60\u00a0%",
  ]);
  expect(cells(3)).toEqual(["0\u00a0of\u00a010", "Not played"]);
  expect(screen.getByText(/14 of 30 planned/)).toBeTruthy();
  expect(screen.getByTestId("besides").textContent).toBe(
    "Played outside the programme: Reach (10 repetitions).",
  );
  expect(screen.getByTestId("timer").textContent).toContain(
    "1\u00a0min 1\u00a0s of 1\u00a0minute played: the time is over",
  );
});

it("does not call pending items omitted", async () => {
  show({ ...PLAN, ended: false, items: [{ ...ITEM, runs: [], repetitions_done: 0, done: "none" }] });
  expect(await screen.findByText("Not yet")).toBeTruthy();
});

it("shows nothing without a programme", async () => {
  const { asked, container } = show({ ...PLAN, programme: null, items: [] });
  await waitFor(() => expect(asked).toHaveBeenCalled());
  await waitFor(() => expect(container.querySelector("section")).toBeNull());
});
