/** The highest resistance level; the lowest is 1. */
export const LOAD_LEVELS = 25;

/**
 * Return the preselected level: the last one, up to the doctor's limit. Null without a last level, so that
 * the user must choose: a low level refuses to hold a heavy arm and a high one does not feel the patient
 * (docs/explanation/decisions/0023-the-therapist-chooses-the-first-resistance-level.md).
 */
export function firstLevel(last: number | null, highest: number | null): number | null {
  return last === null ? null : Math.min(last, highest ?? LOAD_LEVELS);
}
