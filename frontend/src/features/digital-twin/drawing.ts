import type { Answer, Beginning, Picture } from "./scene/picture";

/** A picture that is asked for and not drawn for so long is behind: what is seen then is not where the arm is. */
export const BEHIND_AFTER_MS = 2000;

export interface Listening {
  /** What is seen is older than it may be, or no longer so. */
  onBehind: (behind: boolean) => void;
  /** There will be no picture. */
  onUnable: () => void;
}

/** The page's end of the worker that draws: it is sent whole pictures, and says which one it has drawn. */
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

  /** Change what is to be seen. */
  change(what: Partial<Omit<Picture, "number">>) {
    this.#picture = { ...this.#picture, ...what, number: this.#picture.number + 1 };
    this.#ask();
  }

  /** Nothing is drawn afterwards, and nothing told. */
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
