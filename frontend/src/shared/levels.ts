/** Load levels go from 1 to this one. */
export const LOAD_LEVELS = 25;

/** The level that is offered first: the last one, never more than the doctor allows. */
export function firstLevel(last: number | null, highest: number | null): number {
  const most = highest ?? LOAD_LEVELS;
  return Math.min(last ?? most, most);
}
