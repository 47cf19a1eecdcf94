import { afterEach, expect, it, vi } from "vitest";
import type { Schemas } from "../lib/api/client";
import { enlarged, fitTexts, textScale, wrapped } from "./plotTexts";

afterEach(() => {
  vi.unstubAllGlobals();
  document.documentElement.style.fontSize = "";
});

const LONG = "Over 18 points better: important, and more than chance";
const figure = (data: object[], layout: object = {}) =>
  ({ data, layout, texts: [] }) as unknown as Schemas["Figure"];

it("breaks a long name between words", () => {
  expect(wrapped(LONG, 230)).toBe("Over 18 points better:<br>important, and more than<br>chance");
  expect(wrapped("Baseline", 230)).toBe("Baseline");
  expect(wrapped("Incomprehensibilities", 50)).toBe("Incomprehensibilities");
  expect(wrapped(LONG, 230, 2)).toBe("Over 18 points better:<br>important, and more than…");
});

it("breaks a Japanese name, but never before a punctuation mark", () => {
  expect(wrapped("十八点を超える改善、重要で偶然ではない", 9 * 13)).toBe(
    "十八点を超える改<br>善、重要で偶然では<br>ない",
  );
});

it("changes no figure whose texts fit", () => {
  const title = { text: "Flexion, °", x: 0, xref: "paper" };
  const wide = figure(
    [
      { name: LONG, y: [1] },
      { name: "SPADI", y: ["All (n = 36)"] },
    ],
    {
      annotations: [title],
      xaxis: { domain: [0, 0.455] },
    },
  );
  expect(fitTexts(wide, 1200)).toEqual(wide);
  expect(fitTexts(wide, 0)).toBe(wide);
});

it("breaks the names of lines and bars on a telephone, and shows fewer numbers", () => {
  const fitted = fitTexts(
    figure([{ name: LONG, y: ["Programme: Range of motion<br>(n = 25)"] }], { xaxis: {} }),
    328,
  );
  expect(fitted.data).toEqual([
    { name: expect.stringContaining("<br>"), y: ["Programme: Range<br>of motion<br>(n = 25)"] },
  ]);
  expect(fitted.layout.xaxis).toEqual({ nticks: 4 });
});

it("gives a figure the size of the page's texts, but not on a telephone", () => {
  expect(textScale()).toBe(1);
  document.documentElement.style.fontSize = "22px";
  vi.stubGlobal("innerWidth", 2560);
  expect(textScale()).toBe(1.375);
  vi.stubGlobal("innerWidth", 390);
  expect(textScale()).toBe(1);
  const given = figure([{ y: [1] }], {
    font: { family: "serif", size: 10 },
    height: 300,
    margin: { l: 60 },
    x: 1,
  });
  expect(enlarged(given, 1.5)).toEqual(
    figure([{ y: [1] }], { font: { family: "serif", size: 15 }, height: 450, margin: { l: 90 }, x: 1 }),
  );
  expect(enlarged(figure([]), 1.5).layout).toEqual({ font: { size: 18 } });
  expect(enlarged(given, 1)).toBe(given);
});
