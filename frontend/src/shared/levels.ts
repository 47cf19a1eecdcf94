/** Load levels go from 1 to this one. */
export const LOAD_LEVELS = 25;
