import { afterEach, expect, test, vi } from "vitest";

afterEach(() => {
  Reflect.deleteProperty(navigator, "language");
  vi.resetModules();
});

test.each([
  ["en-US@posix", "en-US"],
  ["ja-JP", "ja-JP"],
])("of %s comes a language that numbers can be written in", async (told, used) => {
  Object.defineProperty(navigator, "language", { value: told, configurable: true });
  await import("./language");
  expect(navigator.language).toBe(used);
  expect(new Intl.NumberFormat(navigator.language).format(1)).toBe("1");
});
