import { afterEach, expect, test, vi } from "vitest";

const spoken = (told: string) =>
  Object.defineProperty(navigator, "language", { value: told, configurable: true });

afterEach(() => {
  Reflect.deleteProperty(navigator, "language");
  localStorage.clear();
  vi.resetModules();
});

test.each([
  ["en-US@posix", "en-US"],
  ["ja-JP", "ja-JP"],
])("of %s comes a language that numbers can be written in", async (told, used) => {
  spoken(told);
  await import("./language");
  expect(navigator.language).toBe(used);
  expect(new Intl.NumberFormat(navigator.language).format(1)).toBe("1");
});

test.each([
  ["en-GB", null, "en", "en-GB"],
  ["ja-JP", null, "ja", "ja-JP"],
  ["de-DE", null, "en", "en"],
  ["ja-JP", "en", "en", "en"],
  ["en-GB", "ja", "ja", "ja"],
  ["en-GB", "klingon", "en", "en-GB"],
])("a browser of %s where %s was chosen speaks %s", async (told, kept, language, locale) => {
  spoken(told);
  if (kept) localStorage.setItem("kata.language", kept);
  const { LANGUAGE, LOCALE, say } = await import("./language");
  expect([LANGUAGE, LOCALE, document.documentElement.lang]).toEqual([language, locale, language]);
  expect(say({ stop: "Stop" }, { stop: "停止" }).stop).toBe(language === "ja" ? "停止" : "Stop");
});
