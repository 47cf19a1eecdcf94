import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

const setBrowserLanguage = (browser: string) =>
  Object.defineProperty(navigator, "language", { value: browser, configurable: true });

// Another import may already have loaded the module.
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
])("replaces %s by a language that Intl accepts", async (browser, expected) => {
  setBrowserLanguage(browser);
  await import("./language");
  expect(navigator.language).toBe(expected);
  expect(new Intl.NumberFormat(navigator.language).format(1)).toBe("1");
});

test.each([
  ["en-GB", null, "en", "en-GB"],
  ["ja-JP", null, "ja", "ja-JP"],
  ["de-DE", null, "en", "en"],
  ["ja-JP", "en", "en", "en"],
  ["en-GB", "ja", "ja", "ja"],
  ["en-GB", "klingon", "en", "en-GB"],
])("in a %s browser with choice %s shows %s", async (browser, stored, language, locale) => {
  setBrowserLanguage(browser);
  if (stored) localStorage.setItem("kata.language", stored);
  const { LANGUAGE, LOCALE } = await import("./language");
  const { t } = await import("./i18n");
  expect([LANGUAGE, LOCALE, document.documentElement.lang]).toEqual([language, locale, language]);
  expect(t("common:stop.stop")).toBe(language === "ja" ? "停止" : "Stop");
});

const stubReload = () => {
  const reload = vi.fn();
  vi.stubGlobal("location", { reload });
  return reload;
};

test("reloads the page only for another supported language", async () => {
  setBrowserLanguage("en-GB");
  const reload = stubReload();
  const { switchLanguage } = await import("./language");
  for (const language of ["en", "", "klingon"]) switchLanguage(language);
  expect(reload).not.toHaveBeenCalled();
  switchLanguage("ja");
  expect(reload).toHaveBeenCalledOnce();
  expect(localStorage.getItem("kata.language")).toBe("ja");
});

test.each(["throws", "forgets"])("does not reload if the storage %s", async (behaviour) => {
  setBrowserLanguage("en-GB");
  const reload = stubReload();
  vi.spyOn(Storage.prototype, "getItem").mockImplementation(() => {
    if (behaviour === "throws") throw new DOMException("denied", "SecurityError");
    return null;
  });
  vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
    if (behaviour === "throws") throw new DOMException("denied", "SecurityError");
  });
  const { LANGUAGE, switchLanguage } = await import("./language");
  expect(LANGUAGE).toBe("en");
  switchLanguage("ja");
  expect(reload).not.toHaveBeenCalled();
});

describe("the texts", () => {
  afterEach(() => {
    vi.doUnmock("../locales/ja");
    vi.doUnmock("../locales/en");
  });

  async function speaking(language: "en" | "ja") {
    localStorage.setItem("kata.language", language);
    return (await import("./i18n")).t;
  }

  test.each([
    ["en", "ja", "Stop"],
    ["ja", "en", "停止"],
  ] as const)("a page that speaks %s loads no text of %s", async (language, other, stop) => {
    vi.doMock(`../locales/${other}`, () => {
      throw new Error("loaded");
    });
    expect((await speaking(language))("common:stop.stop")).toBe(stop);
  });

  test("what a person has written is shown as it is", async () => {
    const t = await speaking("en");
    const name = "<b>{{count}}</b> $t(common:stop.stop) & 'sons'";
    expect(t("station:lease.takeOverFrom", { who: name })).toBe(`Take over from ${name}`);
  });

  test("plurals and lists follow the language", async () => {
    const t = await speaking("en");
    expect(t("sessions:session.reversals", { count: 1 })).toBe("moved back once by resistance");
    expect(t("sessions:session.reversals", { count: 2 })).toBe("moved back 2 times by resistance");
    expect(t("common:format.list", { words: ["a", "b", "c"] })).toBe("a, b, c");
    vi.resetModules();
    const japanese = await speaking("ja");
    expect(japanese("sessions:session.reversals", { count: 1 })).toBe("抵抗による引き戻し1回");
    expect(japanese("common:format.list", { words: ["a", "b", "c"] })).toBe("a、b、c");
  });
});
