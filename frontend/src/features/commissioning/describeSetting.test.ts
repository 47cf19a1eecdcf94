import { afterEach, expect, it, vi } from "vitest";

afterEach(() => localStorage.clear());

it.each([
  ["side", "right", "右"],
  ["port", "simulated", "模擬装置"],
  ["rts_direction", "off", "切り替えない"],
  // A station may have such a name.
  ["name", "right", ""],
  ["port", "/dev/ttyUSB0", ""],
  ["baud", "57600", ""],
])("the Japanese page names the value of %s: %s", async (field, value, words) => {
  vi.resetModules();
  localStorage.setItem("kata.language", "ja");
  const { describeValue } = await import("./describeSetting");
  expect(describeValue(field, value)).toBe(words);
});

it("the English page shows a word of the file once", async () => {
  vi.resetModules();
  const { describeValue } = await import("./describeSetting");
  expect(describeValue("side", "right")).toBe("");
});
