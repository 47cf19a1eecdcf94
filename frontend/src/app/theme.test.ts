import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { DEFAULT_THEME } from "@mantine/core";
import { describe, expect, it } from "vitest";
import { SCENE_COLOURS } from "../features/digital-twin/colours";
import { DARK_COLOURS } from "../ui/plotColours";
import { contrast } from "../ui/testContrast";
import { CONTROL_EDGE, STALE, TORQUE, TRACES } from "./theme";

const { dark, gray, indigo } = DEFAULT_THEME.colors;
/** The page and a card, in both schemes. */
const GROUNDS = [
  ["light", "#ffffff"],
  ["light", gray[1]],
  ["dark", dark[7]],
  ["dark", dark[6]],
] as const;

/** Return the hue in degrees and the chroma (0 for grey, 1 for a pure colour). */
function hueOf(colour: string): { hue: number; chroma: number } {
  const [r, g, b] = [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16) / 255) as [
    number,
    number,
    number,
  ];
  const largest = Math.max(r, g, b);
  const chroma = largest - Math.min(r, g, b);
  if (chroma === 0) return { hue: 0, chroma };
  const sixth =
    largest === r ? ((g - b) / chroma + 6) % 6 : largest === g ? (b - r) / chroma + 2 : (r - g) / chroma + 4;
  return { hue: 60 * sixth, chroma };
}

/** True if the colour looks red, yellow or cyan. */
function isAlarmColour(colour: string): boolean {
  const { hue, chroma } = hueOf(colour);
  const hueWithin = (target: number, tolerance: number) =>
    Math.min(Math.abs(hue - target), 360 - Math.abs(hue - target)) <= tolerance;
  return chroma > 0.35 && (hueWithin(0, 15) || hueWithin(54, 14) || hueWithin(185, 15));
}

const FILES = readdirSync("src", { recursive: true, encoding: "utf8" })
  .filter((name) => /\.(css|tsx?)$/.test(name) && !/\.test\.|schema\.d/.test(name))
  .map((name) => [name, readFileSync(join("src", name), "utf8")] as const);

describe("the alarm colours", () => {
  it("are distinguished from other colours", () => {
    for (const colour of ["#c92a2a", "#ffd43b", "#15aabf"]) expect(isAlarmColour(colour), colour).toBe(true);
    for (const colour of ["#d67500", "#1f3a93", "#5f6b14"]) expect(isAlarmColour(colour), colour).toBe(false);
  });

  it("appear in no trace and on no apparatus part", () => {
    const used = [
      ...Object.values(TRACES).flatMap((scheme) => Object.values(scheme)),
      ...Object.entries(DARK_COLOURS).flat(),
      ...Object.values(SCENE_COLOURS).flatMap(({ motors, ghost }) => [...Object.values(motors), ghost]),
    ].filter((colour) => colour.startsWith("#"));
    expect(used.length).toBeGreaterThan(20);
    expect(used.filter(isAlarmColour)).toEqual([]);
  });

  it("appear only in alarms and Stop", () => {
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

describe("the edge of a cut table", () => {
  it("keeps the contrast of the text above it", () => {
    const strengths = [
      ...readFileSync("src/app/page.css", "utf8").matchAll(
        /--kata-shadow\) \/ calc\(var\(--kata-cut-\w+\) \* (\d+)%\)\), transparent/g,
      ),
    ];
    expect(strengths).toHaveLength(2);
    for (const [, strength] of strengths) {
      const share = Number(strength) / 100;
      expect(contrast(indigo[8], mixed("#ffffff", "#000000", share))).toBeGreaterThanOrEqual(4.5);
      expect(contrast(indigo[3], mixed(dark[7], "#ffffff", share))).toBeGreaterThanOrEqual(4.5);
    }
  });
});

describe("the state of a station with torque", () => {
  it.each(GROUNDS)("is seen and read in the %s scheme on %s", (scheme, background) => {
    const { fill, text } = TORQUE[scheme];
    expect(contrast(fill, background)).toBeGreaterThanOrEqual(3);
    expect(contrast(text, fill)).toBeGreaterThanOrEqual(4.5);
    expect(isAlarmColour(fill)).toBe(false);
  });
});

/** Return the colour of a layer over a background. */
function mixed(background: string, layer: string, share: number): string {
  const parts = [1, 3, 5].map((at) => {
    const [under, over] = [background, layer].map((colour) =>
      Number.parseInt(colour.slice(at, at + 2), 16),
    ) as [number, number];
    return Math.round(under + (over - under) * share);
  });
  return `#${parts.map((part) => part.toString(16).padStart(2, "0")).join("")}`;
}

describe("outdated words", () => {
  it.each(GROUNDS)("are readable in the %s scheme on %s", (scheme, background) => {
    expect(contrast(STALE[scheme], background)).toBeGreaterThanOrEqual(4.5);
  });
});

describe("the edge of a control", () => {
  // Also on the inside of a field.
  it.each([...GROUNDS, ["dark", dark[5]]] as const)(
    "is visible in the %s scheme on %s",
    (scheme, background) => {
      expect(contrast(CONTROL_EDGE[scheme], background)).toBeGreaterThanOrEqual(3);
    },
  );
});
