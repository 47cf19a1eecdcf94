/** The highest resistance level; the lowest is 1. */
export const RESISTANCE_LEVELS = 25;

/**
 * Return the preselected level: the last one, but at most the doctor's limit. Return null without a last level,
 * because the user must then choose: a low level cannot hold a heavy arm, and a high level does not detect the
 * patient's resistance (docs/explanation/decisions/0023-the-therapist-chooses-the-first-resistance-level.md).
 */
export function firstResistanceLevel(last: number | null, highest: number | null): number | null {
  return last === null ? null : Math.min(last, highest ?? RESISTANCE_LEVELS);
}
