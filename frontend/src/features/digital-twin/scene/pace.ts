/** Of the time, how much drawing may take. A graphics card needs far less; what draws in software would take all there is. */
const SHARE = 0.25;
/** A picture is never older than this and one drawing, however long a drawing takes. */
const LONGEST_REST_MS = 1000;

/** When the next drawing may begin. It is told the times, milliseconds of one clock, and asks for none. */
export class Pace {
  #restedAt = Number.NEGATIVE_INFINITY;

  /** A drawing took from the one time to the other. */
  drew(from_ms: number, to_ms: number) {
    const rest = (to_ms - from_ms) * (1 / SHARE - 1);
    this.#restedAt = to_ms + Math.min(LONGEST_REST_MS, rest);
  }

  /** How long to wait before the next one. */
  wait_ms(now_ms: number): number {
    return Math.max(0, this.#restedAt - now_ms);
  }
}
