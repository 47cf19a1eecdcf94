import { expect, it } from "vitest";
import { describeMissingComparison } from "./RunHeading";

it.each([
  ["loaded", null, /has not ended/],
  ["completed", 0, /reduced/],
  ["unloaded", null, /^Nothing was played/],
] as const)("says why a playback that is %s has no errors", (outcome, compared_percent, words) => {
  expect(describeMissingComparison({ outcome, compared_percent })).toMatch(words);
});
