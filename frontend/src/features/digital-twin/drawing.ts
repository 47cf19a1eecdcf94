import type { Answer, Beginning, Picture } from "./scene/picture";

/** A picture that is not drawn within this time is late: the screen no longer shows the arm's position. */
export const BEHIND_AFTER_MS = 2000;

export interface Listening {
  /** The shown picture is too old, or up to date again. */
  onBehind: (behind: boolean) => void;
  /** No picture can be drawn. */
  onUnable: () => void;
}

/**
 * The page's side of the drawing worker. It sends complete pictures and receives the number of each drawn
 * one.
 */
export class Drawing {
  readonly #worker: Worker;
  readonly #listening: Listening;
  #picture: Picture;
  #behind = false;
  #waiting: ReturnType<typeof setTimeout> | null = null;

  constructor(worker: Worker, beginning: Beginning, first: Omit<Picture, "number">, listening: Listening) {
    this.#worker = worker;
    this.#listening = listening;
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if ("unable" in data) listening.onUnable();
      else this.#drawn(data.drawn);
    };
    worker.onerror = () => listening.onUnable();
    worker.postMessage(beginning, [beginning.canvas]);
    this.#picture = { ...first, number: 0 };
    this.#ask();
  }

  /** Change parts of the picture. */
  change(what: Partial<Omit<Picture, "number">>) {
    this.#picture = { ...this.#picture, ...what, number: this.#picture.number + 1 };
    this.#ask();
  }

  /** Stop drawing and all callbacks. */
  close() {
    this.#worker.onmessage = null;
    this.#worker.onerror = null;
    this.#worker.terminate();
    this.#watch(false);
  }

  #ask() {
    this.#worker.postMessage(this.#picture);
    if (this.#waiting === null) this.#watch(true);
  }

  #drawn(number: number) {
    this.#watch(number < this.#picture.number);
    this.#tell(false);
  }

  #watch(on: boolean) {
    if (this.#waiting !== null) clearTimeout(this.#waiting);
    this.#waiting = on ? setTimeout(() => this.#tell(true), BEHIND_AFTER_MS) : null;
  }

  #tell(behind: boolean) {
    if (behind === this.#behind) return;
    this.#behind = behind;
    this.#listening.onBehind(behind);
  }
}
