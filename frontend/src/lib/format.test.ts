import { expect, it } from "vitest";
import {
  changeAsShown,
  formatAfter,
  formatChange,
  formatDays,
  formatDuration,
  formatMeasured,
  formatMoment,
  formatShortDays,
  totalAsShown,
  totalDuration,
} from "./format";
import { withoutJoiners } from "./joinUnits";

it("shows only the time for a later moment that day", () => {
  const began = new Date(2026, 10, 22, 23, 30).toISOString();
  const sameDay = new Date(2026, 10, 22, 23, 50).toISOString();
  const nextDay = new Date(2026, 10, 23, 0, 10).toISOString();
  expect(formatMoment(sameDay)).toContain(formatAfter(sameDay, began));
  expect(formatAfter(sameDay, began)).not.toContain("2026");
  expect(formatAfter(nextDay, began)).toBe(formatMoment(nextDay));
});

it.each([
  ["2026-11-03", "2026-11-30", "Nov 3 to Nov 30, 2026"],
  ["2025-12-30", "2026-01-02", "Dec 30, 2025 to Jan 2, 2026"],
  ["2026-11-03", "2026-11-03", "Nov 3, 2026"],
])("writes the year of a period once: %s to %s", (first, last, period) => {
  expect(withoutJoiners(formatDays(first, last))).toBe(period);
});

it("divides no period of one year", () => {
  expect(formatDays("2026-11-03", "2026-11-30")).not.toContain(" ");
});

it("leaves the year out of short days only within one year", () => {
  const [first, last] = [new Date(2026, 9, 21).toISOString(), new Date(2026, 10, 25).toISOString()];
  expect(formatShortDays([first, last])).toEqual(["Oct\u00a021", "Nov\u00a025"]);
  expect(formatShortDays([new Date(2025, 9, 21).toISOString(), last])).toEqual(["10/25", "11/26"]);
});

it("rounds no measured value to a whole one", () => {
  expect([122.5, 45, -17.25, 7.96, null].map(formatMeasured)).toEqual(["122.5", "45", "−17.3", "8", "–"]);
});

it.each([
  [79.769, 44.14, 1, -35.7],
  [44.25, 52.25, 1, 8],
  [0.04, 0.06, 1, 0.1],
  [1.204, 1.206, 2, 0.01],
  [3, 3, 0, 0],
])("shows the change from %s to %s as the difference of the shown numbers", (before, now, digits, change) => {
  expect(changeAsShown(before, now, digits)).toBe(change);
});

it("adds up times and numbers as they are shown", () => {
  expect([9.6, 15.3, totalDuration([9.6, 15.3])].map(formatDuration)).toEqual([
    "10\u00a0s",
    "16\u00a0s",
    "26\u00a0s",
  ]);
  expect(totalAsShown([0.334, 0.334, 0.334], 2)).toBe(0.99);
  expect(totalAsShown([0.1, 0.2], 1)).toBe(0.3);
});

it("gives a change no sign if it is shown as none", () => {
  expect([3, -35.62, 0.06, 0.04, -0.04].map(formatChange)).toEqual(["+3", "−35.6", "+0.1", "0", "0"]);
});
