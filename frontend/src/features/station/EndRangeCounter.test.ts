import { expect, it } from "vitest";
import type { Session } from "../../lib/api/client";
import { storedEndRangeS } from "./EndRangeCounter";

const run = (id: string, position: number | null, times: [number, number | null][]) => ({
  id,
  programme_position: position,
  comparison: { motions: times.map(([motion, end_range_s]) => ({ motion, end_range_s })) },
});
const SESSION = {
  id: "s",
  programme: {
    items: [
      { position: 1, end_range: { motion: 4, minutes: 5 } },
      { position: 2, end_range: { motion: 6, minutes: 5 } },
      { position: 3, end_range: null },
    ],
  },
  runs: [
    run("a", 1, [
      [4, 30.9],
      [6, 500],
    ]),
    run("b", 1, [[4, 12.8]]),
    run("b2", 1, [[4, null]]),
    run("c", 2, [[4, 500]]),
    run("d", null, [[4, 500]]),
    run("now", 1, [[4, 500]]),
  ],
} as unknown as Session;

it("adds the stored times of earlier playbacks that prescribe the motion", () => {
  const live = { run_id: "now", session_id: "s" };
  expect(storedEndRangeS(SESSION, live, 4)).toBeCloseTo(43.7);
  expect(storedEndRangeS(SESSION, { ...live, session_id: "other" }, 4)).toBe(0);
  expect(storedEndRangeS(null, live, 4)).toBe(0);
});
