import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { GHOST, MOTOR_COLOURS } from "../features/digital-twin/colours";
import { IN_THE_DARK } from "../ui/plotColours";
import { TRACES } from "./theme";

/** Degrees of hue, and how far from grey. */
function hueOf(colour: string): { hue: number; chroma: number } {
  const [r, g, b] = [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16) / 255) as [
    number,
    number,
    number,
  ];
  const most = Math.max(r, g, b);
  const chroma = most - Math.min(r, g, b);
  if (chroma === 0) return { hue: 0, chroma };
  const sixth =
    most === r ? ((g - b) / chroma + 6) % 6 : most === g ? (b - r) / chroma + 2 : (r - g) / chroma + 4;
  return { hue: 60 * sixth, chroma };
}

/** Red, yellow, cyan, as an eye would call them. */
function isAlarmColour(colour: string): boolean {
  const { hue, chroma } = hueOf(colour);
  const near = (what: number, by: number) => Math.min(Math.abs(hue - what), 360 - Math.abs(hue - what)) <= by;
  return chroma > 0.35 && (near(0, 15) || near(54, 14) || near(185, 15));
}

const FILES = readdirSync("src", { recursive: true, encoding: "utf8" })
  .filter((name) => /\.(css|tsx?)$/.test(name) && !/\.test\.|schema\.d|src\/alarms|^alarms/.test(name))
  .map((name) => [name, readFileSync(join("src", name), "utf8")] as const);

describe("red, yellow and cyan", () => {
  it("are told from other colours", () => {
    for (const colour of ["#c92a2a", "#ffd43b", "#15aabf"]) expect(isAlarmColour(colour), colour).toBe(true);
    for (const colour of ["#e07b00", "#1f3a93", "#5f6b14"]) expect(isAlarmColour(colour), colour).toBe(false);
  });

  it("are worn by no trace, in neither scheme, and by nothing of the apparatus", () => {
    const worn = [
      ...Object.values(TRACES).flatMap((one) => Object.values(one)),
      ...Object.entries(IN_THE_DARK).flat(),
      ...Object.values(MOTOR_COLOURS),
      GHOST,
    ].filter((colour) => colour.startsWith("#"));
    expect(worn.length).toBeGreaterThan(20);
    expect(worn.filter(isAlarmColour)).toEqual([]);
  });

  it("are worn by nothing else that is written anywhere but alarms and Stop", () => {
    const found = FILES.flatMap(([name, text]) => [
      ...(text.match(/#[0-9a-f]{6}\b/gi) ?? []).filter(isAlarmColour).map((colour) => `${name}: ${colour}`),
      ...(text.match(/["'-](red|yellow|cyan|teal|orange|lime|pink)([.\s-]\d)?\b["')]?/g) ?? []).map(
        (word) => `${name}: ${word}`,
      ),
    ]);
    expect(found.sort()).toEqual([
      "app/page.css: #15aabf",
      "app/page.css: #c92a2a",
      "app/page.css: #ffd43b",
      'safety/StopButton.tsx: "red.8"',
    ]);
  });
});
