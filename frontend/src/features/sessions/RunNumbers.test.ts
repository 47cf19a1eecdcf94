import { expect, it } from "vitest";
import { describeEndRange, explainTimes } from "./RunNumbers";

type Motion = Parameters<typeof describeEndRange>[0];
const words = (given: Partial<Motion>) => describeEndRange(given as Motion);

it("an end-range time has the limits by which it was counted", () => {
  expect(words({ end_range_s: 92.6, end_range_band_deg: 5, end_range_torque_nm: 1.5 })).toBe(
    "92.6\u00a0s (last 5°, at least 1.5\u00a0Nm)",
  );
  expect(words({ end_range_s: null })).toBe("–");
});

it.each([
  [0.0004, 1, undefined],
  [0.0951, 2, "Real time is ahead of motion time by up to 0.095\u00a0s."],
])("an offset of the clock of %s s is said in %s sentences", (offset_s, sentences, last) => {
  const said = explainTimes(offset_s);
  expect(said).toHaveLength(sentences);
  expect(said[1]).toBe(last);
});
