import { expect, it } from "vitest";
import { firstLevel } from "./loadLevels";

it("offers the last level, none where there was none, and never more than the doctor allows", () => {
  expect(firstLevel(null, null)).toBeNull();
  expect(firstLevel(7, null)).toBe(7);
  expect(firstLevel(null, 12)).toBeNull();
  expect(firstLevel(20, 12)).toBe(12);
  expect(firstLevel(7, 12)).toBe(7);
});
