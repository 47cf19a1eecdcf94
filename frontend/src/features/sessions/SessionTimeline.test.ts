import { expect, it } from "vitest";
import type { Run } from "../../lib/api/client";
import { stopsOfRuns } from "./SessionTimeline";

const RUN = { id: "r1", started_at: "2026-11-25T09:00:00Z", ended_at: "2026-11-25T09:01:00Z" };
const STOPPED = {
  ...RUN,
  stop: { code: "estop_pressed", message: "The emergency stop was pressed." },
} as Run;

it("a stop without a recorded alarm is at the end of its playback, one with an alarm only once", () => {
  expect(stopsOfRuns([STOPPED], [])).toMatchObject([{ at: RUN.ended_at, kind: "stop" }]);
  expect(stopsOfRuns([STOPPED], [])[0]?.words).toContain("The emergency stop was pressed.");
  expect(stopsOfRuns([STOPPED], [{ run_id: "r1" }])).toEqual([]);
  expect(stopsOfRuns([{ ...RUN, stop: null } as Run], [])).toEqual([]);
});
