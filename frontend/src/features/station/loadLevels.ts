/** Load levels go from 1 to this one. */
export const LOAD_LEVELS = 25;

/**
 * The level that is offered first: the last one, never more than the doctor allows. Null where there is none: it has to be chosen, because
 * a low level refuses to hold a heavy arm and a high one feels no patient (docs/explanation/decisions/0023-the-therapist-chooses-the-first-resistance-level.md).
 */
export function firstLevel(last: number | null, highest: number | null): number | null {
  return last === null ? null : Math.min(last, highest ?? LOAD_LEVELS);
}
