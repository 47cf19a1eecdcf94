import { expect, it } from "vitest";
import { contrast, luminance } from "../../ui/testContrast";
import { SCENE_COLOURS, type Scheme } from "./colours";

const SCHEMES: Scheme[] = ["light", "dark"];

it("has the background of its scheme", () => {
  for (const colour of SCENE_COLOURS.light.background) expect(luminance(colour)).toBeGreaterThan(0.7);
  for (const colour of SCENE_COLOURS.dark.background) expect(luminance(colour)).toBeLessThan(0.03);
});

it.each(SCHEMES)("shows motors, ranges and ghost on the background: %s", (scheme) => {
  const { motors, ghost, background } = SCENE_COLOURS[scheme];
  for (const colour of [...Object.values(motors), ghost])
    for (const behind of background) expect(contrast(colour, behind), colour).toBeGreaterThan(3);
});

it.each(SCHEMES)("has a readable number on each motor: %s", (scheme) => {
  const { motors, onMotor } = SCENE_COLOURS[scheme];
  for (const colour of Object.values(motors)) expect(contrast(colour, onMotor), colour).toBeGreaterThan(4.5);
});

it("shows patient and apparatus on the dark background", () => {
  const { eye, hair, ...parts } = SCENE_COLOURS.dark.parts;
  for (const [name, colour] of Object.entries(parts))
    for (const behind of SCENE_COLOURS.dark.background)
      expect(contrast(colour, behind), name).toBeGreaterThan(3);
  for (const colour of [eye, hair]) expect(contrast(colour, parts.skin), colour).toBeGreaterThan(3);
});
