import { afterEach, beforeEach, expect, test, vi } from "vitest";

const spoken = (told: string) =>
  Object.defineProperty(navigator, "language", { value: told, configurable: true });

// Whatever stood before the first of these tests has loaded it already.
beforeEach(() => vi.resetModules());
afterEach(() => {
  Reflect.deleteProperty(navigator, "language");
  vi.restoreAllMocks();
  localStorage.clear();
  vi.unstubAllGlobals();
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

const reloads = () => {
  const reload = vi.fn();
  vi.stubGlobal("location", { reload });
  return reload;
};

test("another language loads the page anew, the same one, none or nonsense does not", async () => {
  spoken("en-GB");
  const reload = reloads();
  const { speak } = await import("./language");
  for (const told of ["en", "", "klingon"]) speak(told);
  expect(reload).not.toHaveBeenCalled();
  speak("ja");
  expect(reload).toHaveBeenCalledOnce();
  expect(localStorage.getItem("kata.language")).toBe("ja");
});

test.each(["throws", "forgets"])(
  "a browser that %s what it is to keep loads the page only once",
  async (does) => {
    spoken("en-GB");
    const reload = reloads();
    vi.spyOn(Storage.prototype, "getItem").mockImplementation(() => {
      if (does === "throws") throw new DOMException("denied", "SecurityError");
      return null;
    });
    vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
      if (does === "throws") throw new DOMException("denied", "SecurityError");
    });
    const { LANGUAGE, speak } = await import("./language");
    expect(LANGUAGE).toBe("en");
    speak("ja");
    expect(reload).not.toHaveBeenCalled();
  },
);
