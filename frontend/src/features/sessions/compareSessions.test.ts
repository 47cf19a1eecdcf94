import { expect, it } from "vitest";
import type { Run, Session } from "../../lib/api/client";
import { compareSessions, type Line } from "./compareSessions";

const comparison = (rmse: number[], peak: number[], reached: number) =>
  ({
    motors: rmse.map((rmse_deg, n) => ({ motor: n + 1, rmse_deg, peak_deg: peak[n] })),
    motions: [{ motion: 4, name: "Abduction", played_min_deg: 10, played_max_deg: reached }],
  }) as unknown as Run["comparison"];
const run = (of: Partial<Run>) =>
  ({
    recording_id: "lift",
    recording_name: "Lift",
    range_percent: 100,
    resistance_level: 20,
    comparison: null,
    ...of,
  }) as Run;
const session = (runs: Run[], pain: (number | null)[]) =>
  ({ runs, pain_before: pain[0], pain_during: pain[1], pain_after: pain[2] }) as Session;

const cells = (lines: Line[] | undefined) => lines?.map(({ other, here, change }) => [other, here, change]);

it("compares pain and the recordings of both sessions", () => {
  const other = session(
    [
      run({ repetitions_done: 3, reversals: 1, comparison: comparison([0.2, 0.4], [-1.5, 0.5], 50) }),
      run({ repetitions_done: 5, reversals: 0, comparison: comparison([0.3, 0.1], [0.5, -0.8], 52.5) }),
      // This run was stopped before a measurement, so the earlier run is used.
      run({ repetitions_done: 0 }),
    ],
    [6, null, 5],
  );
  const here = session(
    [
      run({
        repetitions_done: 6,
        reversals: 0,
        resistance_level: 22,
        least_range_percent: 60,
        comparison: comparison([0.1, 0.2], [0.3, -0.6], 60),
      }),
      run({ recording_id: "turn", recording_name: "Turn", repetitions_done: 2, reversals: 2 }),
    ],
    [4, 5, 5],
  );
  const [pain, lift, turn] = compareSessions(other, here);
  expect(cells(pain?.lines)).toEqual([
    ["6", "4", "−2"],
    ["–", "5", ""],
    ["5", "5", "0"],
  ]);
  expect(lift?.title).toBe("Lift");
  expect(cells(lift?.lines)).toEqual([
    ["5", "6", "+1"],
    ["100", "100", "0"],
    // A reduced range explains a smaller angle.
    ["–", "60", ""],
    ["20", "22", "+2"],
    ["0", "0", "0"],
    ["0.30", "0.20", "−0.10"],
    ["0.80", "0.60", "−0.20"],
    ["10.0\u00a0to\u00a052.5", "10.0\u00a0to\u00a060.0", ""],
  ]);
  expect(turn?.title).toBe("Turn");
  expect(cells(turn?.lines)).toEqual([
    ["–", "2", ""],
    ["–", "100", ""],
    ["–", "–", ""],
    ["–", "20", ""],
    ["–", "2", ""],
    ["–", "–", ""],
    ["–", "–", ""],
  ]);
});

it("compares no errors of a partial run, but its range", () => {
  const errors = comparison([0.1, 0.2], [0.3, -0.6], 60);
  const whole = session([run({ comparison: errors })], [null, null, null]);
  const partial = session([run({ comparison: errors, partial: true })], [null, null, null]);
  const lines = cells(compareSessions(whole, partial)[1]?.lines);
  expect(lines?.slice(5)).toEqual([
    ["0.20", "–", ""],
    ["0.60", "–", ""],
    ["10.0\u00a0to\u00a060.0", "10.0\u00a0to\u00a060.0", ""],
  ]);
});
