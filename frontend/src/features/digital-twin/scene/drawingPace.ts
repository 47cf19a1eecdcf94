/** The share of time that drawing may take. A graphics card needs far less. */
const SHARE = 0.25;
/** In software, drawing takes processor time from the control loop of a service on the same computer. */
const SHARE_IN_SOFTWARE = 0.05;
/** The longest rest between drawings. A picture is at most this old plus one drawing. */
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
