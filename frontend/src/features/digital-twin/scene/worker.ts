import { Pace } from "./pace";
import type { Answer, Beginning, Picture } from "./picture";
import { Stage } from "./stage";

/**
 * Draws beside the page: where there is no graphics card, whoever hands a picture to the screen waits until it is drawn,
 * and the page, with Stop on it, is not to wait.
 */
class Drawer {
  readonly #pace = new Pace();
  readonly #stage: Stage;
  #next: Picture | null = null;
  #drawn: Picture | null = null;
  #resting: ReturnType<typeof setTimeout> | null = null;
  #frame: number | null = null;
  #ready = false;

  constructor({ canvas, side, limits, density }: Beginning) {
    this.#stage = new Stage(canvas, side, limits, density);
    void this.#stage.prepare().then(() => {
      this.#ready = true;
      this.#later();
    });
  }

  show(picture: Picture) {
    this.#next = picture;
    this.#later();
  }

  #later() {
    // A frame that is coming draws the newest.
    if (!this.#ready || this.#next === null || this.#frame !== null) return;
    // That nobody knows any more where the arm is, is shown without a rest.
    if (this.#drawn?.real && this.#next.real === null) this.#soon();
    else this.#resting ??= setTimeout(() => this.#soon(), this.#pace.wait_ms(performance.now()));
  }

  #soon() {
    if (this.#resting !== null) clearTimeout(this.#resting);
    this.#frame = requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#frame = null;
    this.#resting = null;
    const picture = this.#next;
    if (picture === null) return;
    const from = performance.now();
    this.#stage.draw(picture);
    this.#pace.drew(from, performance.now());
    this.#next = null;
    this.#drawn = picture;
    answer({ drawn: picture.number });
  }
}

function answer(what: Answer) {
  self.postMessage(what);
}

function begin(beginning: Beginning): Drawer | null {
  beginning.canvas.addEventListener("webglcontextlost", () => answer({ unable: true }));
  try {
    return new Drawer(beginning);
  } catch {
    answer({ unable: true });
    return null;
  }
}

self.addEventListener(
  "message",
  ({ data }: MessageEvent<Beginning>) => {
    const drawer = begin(data);
    self.addEventListener("message", ({ data }: MessageEvent<Picture>) => drawer?.show(data));
  },
  { once: true },
);
