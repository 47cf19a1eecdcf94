import type { Picture, WorkerMessage, WorkerSetup } from "./scene/picture";

/**
 * A picture that is not drawn within this time is late, because the screen then no longer shows the arm's
 * position.
 */
export const LATE_AFTER_MS = 2000;

interface DrawingCallbacks {
  /** A picture has been drawn. */
  onDrawn: () => void;
  /** The shown picture is too old, or up to date again. */
  onLate: (late: boolean) => void;
  /** No picture can be drawn. */
  onUnable: () => void;
}

/**
 * The page's side of the drawing worker. It sends complete pictures and receives the number of each picture
 * that was drawn.
 */
export class Drawing {
  readonly #worker: Worker;
  readonly #callbacks: DrawingCallbacks;
  #picture: Picture;
  #late = false;
  #timer: ReturnType<typeof setTimeout> | null = null;

  constructor(
    worker: Worker,
    setup: WorkerSetup,
    first: Omit<Picture, "number">,
    listening: DrawingCallbacks,
  ) {
    this.#worker = worker;
    this.#callbacks = listening;
    worker.onmessage = ({ data }: MessageEvent<WorkerMessage>) => {
      if ("unable" in data) listening.onUnable();
      else this.#drawn(data.drawn);
    };
    worker.onerror = () => listening.onUnable();
    worker.postMessage(setup, [setup.canvas]);
    this.#picture = { ...first, number: 0 };
    this.#send();
  }

  /** Change parts of the picture. */
  change(parts: Partial<Omit<Picture, "number">>) {
    this.#picture = { ...this.#picture, ...parts, number: this.#picture.number + 1 };
    this.#send();
  }

  /** Stop drawing and all callbacks. */
  close() {
    this.#worker.onmessage = null;
    this.#worker.onerror = null;
    this.#worker.terminate();
    this.#watch(false);
  }

  #send() {
    this.#worker.postMessage(this.#picture);
    if (this.#timer === null) this.#watch(true);
  }

  #drawn(number: number) {
    this.#watch(number < this.#picture.number);
    this.#reportLate(false);
    this.#callbacks.onDrawn();
  }

  #watch(on: boolean) {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = on ? setTimeout(() => this.#reportLate(true), LATE_AFTER_MS) : null;
  }

  #reportLate(late: boolean) {
    if (late === this.#late) return;
    this.#late = late;
    this.#callbacks.onLate(late);
  }
}
