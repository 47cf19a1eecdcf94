/** Share of time that drawing may take. A graphics card needs much less. */
const SHARE = 0.25;
/**
 * The same share without a graphics card. Drawing in software takes processor time from the control loop of a
 * service on the same computer.
 */
const SHARE_IN_SOFTWARE = 0.05;
/**
 * Longest rest between drawings. A picture is therefore at most as old as this plus the duration of one
 * drawing.
 */
const LONGEST_REST_MS = 1000;

/** Decides when the next drawing may begin. All times are milliseconds of the caller's clock. */
export class DrawingPace {
  readonly #share: number;
  #restedAt = Number.NEGATIVE_INFINITY;

  constructor(inSoftware = false) {
    this.#share = inSoftware ? SHARE_IN_SOFTWARE : SHARE;
  }

  /** Record the start and end of a drawing. */
  record(from_ms: number, to_ms: number) {
    const rest = (to_ms - from_ms) * (1 / this.#share - 1);
    this.#restedAt = to_ms + Math.min(LONGEST_REST_MS, rest);
  }

  /** Return how long to wait before the next drawing. */
  wait_ms(now_ms: number): number {
    return Math.max(0, this.#restedAt - now_ms);
  }
}
