import type { Limits, Motor } from "../limits";
import type { Angles } from "../posture";
import type { Side } from "../vectors";
import type { View } from "../view";

/** All that is to be seen. The newest counts; what came before it and is not drawn yet may be left out. */
export interface Picture {
  /** Counts up, so that whoever asked knows which one has been drawn. */
  number: number;
  /** Pixels of the page. */
  width: number;
  height: number;
  view: View;
  /** Only this motor's range, and its number before the others. */
  only: Motor | null;
  /** Where the arm is; null while nobody knows: then no arm is drawn. */
  real: Angles | null;
  /** Where a recording has it. */
  ghost: Angles | null;
}

/** What the worker that draws is told first. */
export interface Beginning {
  canvas: OffscreenCanvas;
  side: Side;
  limits: Limits;
  /** Pixels of the screen for one of the page. */
  density: number;
}

/** What it answers: the number of the picture that has just been drawn, or that there will be none. */
export type Answer = { drawn: number } | { unable: true };
