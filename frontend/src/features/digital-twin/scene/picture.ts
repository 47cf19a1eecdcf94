import type { View } from "../camera";
import type { Scheme } from "../colours";
import type { Limits, Motor } from "../limits";
import type { Angles } from "../posture";
import type { Side } from "../vectors";

/**
 * The content of a picture. Only the newest picture matters; older pictures that are not drawn yet may be
 * skipped.
 */
export interface Picture {
  /** Number of the picture, which increases, so that the page knows which picture has been drawn. */
  number: number;
  /** Size in page pixels. */
  width: number;
  height: number;
  view: View;
  /** The colour scheme of the page. */
  scheme: Scheme;
  /** The only motor whose range is drawn; null for all motors. */
  only: Motor | null;
  /** The measured angles. Null while they are unknown; then no arm is drawn. */
  real: Angles | null;
  /** The recording's angles. */
  ghost: Angles | null;
}

/** The first message to the drawing worker. */
export interface WorkerSetup {
  canvas: OffscreenCanvas;
  side: Side;
  limits: Limits;
  /** Screen pixels per page pixel. */
  density: number;
}

/** The worker's message: the number of the picture that was just drawn, or that it cannot draw. */
export type WorkerMessage = { drawn: number } | { unable: true };
