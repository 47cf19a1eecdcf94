import { beforeEach, expect, it, vi } from "vitest";

beforeEach(() => vi.resetModules());

const FIGURE = {
  data: [{ name: "Teaching", x: ["Teaching"], hovertemplate: "%{y:.2f} deg" }],
  layout: { xaxis: { title: { text: "Time, s" } }, font: { family: "Error" } },
};

it.each([
  ["en", FIGURE],
  [
    "ja",
    {
      data: [{ name: "教示", x: ["Teaching"], hovertemplate: "%{y:.2f}°" }],
      layout: { xaxis: { title: { text: "時間（秒）" } }, font: { family: "Error" } },
    },
  ],
])(
  "a figure of a page in %s has its words in that language, and nothing else changed",
  async (language, seen) => {
    localStorage.setItem("kata.language", language);
    await (await import("./told")).learn();
    const { spoken } = await import("./plotWords");
    expect(spoken(FIGURE)).toEqual(seen);
    localStorage.clear();
  },
);
