import type { Schemas } from "../../lib/api/client";
import type { Motion } from "./ghost";
import type { Angles } from "./posture";

/** The range of each motor in degrees, in axis order. */
export type Limits = readonly { min_deg: number; max_deg: number }[];
export type Motor = 1 | 2 | 3 | 4 | 5;
export const MOTORS: readonly Motor[] = [1, 2, 3, 4, 5];

/** A motor counts as at its limit if it is nearer to the limit than this. */
const NEAR_DEG = 3;

export type End = "lower" | "upper";

export const limitsOf = (axes: Schemas["AxisInfo"][]): Limits =>
  axes.map(({ min_deg, max_deg }) => ({ min_deg, max_deg }));

/** Return the limit that each motor has reached or passed, or null. */
export function limitsReached(angles: Angles, limits: Limits): (End | null)[] {
  return angles.map((angle, axis) => {
    const range = limits[axis];
    if (!range) return null;
    if (angle <= range.min_deg + NEAR_DEG) return "lower";
    return angle >= range.max_deg - NEAR_DEG ? "upper" : null;
  });
}

/** The place where a motion first leaves a motor's range. */
export interface RangeViolation {
  motor: Motor;
  at_s: number;
  angle_deg: number;
}

/** Return the first violation of each motor's range. The drives tolerate half a degree. */
export function rangeViolations(motion: Motion, limits: Limits): RangeViolation[] {
  const found: RangeViolation[] = [];
  for (const motor of MOTORS) {
    const range = limits[motor - 1];
    if (!range) continue;
    const [low, high] = [range.min_deg - TOLERANCE_DEG, range.max_deg + TOLERANCE_DEG];
    const row = motion.angles_deg.findIndex((angles) => !within(angles[motor - 1], low, high));
    const angle_deg = motion.angles_deg[row]?.[motor - 1];
    const at_s = motion.times_s[row];
    if (angle_deg !== undefined && at_s !== undefined) found.push({ motor, at_s, angle_deg });
  }
  return found;
}

const TOLERANCE_DEG = 0.5;

const within = (angle: number | undefined, low: number, high: number) =>
  angle !== undefined && low <= angle && angle <= high;
