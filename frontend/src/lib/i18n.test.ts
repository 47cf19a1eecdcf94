import { afterEach, beforeEach, expect, test, vi } from "vitest";

beforeEach(() => vi.resetModules());
afterEach(() => {
  localStorage.clear();
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
