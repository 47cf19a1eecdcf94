import { expect, it } from "vitest";
import { describeHours } from "./hours";

const rows = (count: number, hours: number) => Array.from({ length: count }, () => ({ hours }));

it("adds up the hours that the table shows", () => {
  // The table shows 0.02 three times, and 0.01 four times.
  expect(describeHours(rows(3, 0.016))).toBe("0.1");
  expect(describeHours(rows(4, 0.014))).toBe("0.0");
});
