import { expect, it } from "vitest";
import { firstLevel } from "./loadLevels";

it("offers the last level up to the doctor's limit", () => {
  expect(firstLevel(null, null)).toBeNull();
  expect(firstLevel(7, null)).toBe(7);
  expect(firstLevel(null, 12)).toBeNull();
  expect(firstLevel(20, 12)).toBe(12);
  expect(firstLevel(7, 12)).toBe(7);
});
