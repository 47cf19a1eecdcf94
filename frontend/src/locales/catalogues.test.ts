import { expect, test } from "vitest";
import { differences } from "../../catalogues.mjs";

const english = {
  station: {
    stop: "Stop",
    by: "Stopped by {{name}}",
    checks_one: "{{count}} check",
    checks_other: "{{count}} checks",
  },
};
const japanese = { stop: "停止", by: "{{name}}が停止", checks_other: "{{count}}項目" };

test.each([
  ["complete", japanese, []],
  ["missing", { ...japanese, stop: undefined }, ["ja: station:stop is missing"]],
  ["surplus", { ...japanese, start: "開始" }, ["ja: station:start is surplus"]],
  ["empty", { ...japanese, stop: " " }, ["ja: station:stop is empty"]],
  [
    "another parameter",
    { ...japanese, by: "{{who}}が停止" },
    ["ja: station:by has parameters who instead of name"],
  ],
  [
    "no plural form",
    { ...japanese, checks_other: undefined, checks_one: "{{count}}項目" },
    ["ja: station:checks_other is missing"],
  ],
])("a catalogue that is %s is reported so", (_, texts, wrong) => {
  const translation = JSON.parse(JSON.stringify({ station: texts }));
  expect(differences(english, translation, "ja")).toEqual(wrong);
});
