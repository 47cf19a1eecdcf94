import { expect, it } from "vitest";
import { formatAfter, formatMoment } from "./format";

it("shows only the time for a later moment that day", () => {
  const began = new Date(2026, 10, 22, 23, 30).toISOString();
  const sameDay = new Date(2026, 10, 22, 23, 50).toISOString();
  const nextDay = new Date(2026, 10, 23, 0, 10).toISOString();
  expect(formatMoment(sameDay)).toContain(formatAfter(sameDay, began));
  expect(formatAfter(sameDay, began)).not.toContain("2026");
  expect(formatAfter(nextDay, began)).toBe(formatMoment(nextDay));
});
