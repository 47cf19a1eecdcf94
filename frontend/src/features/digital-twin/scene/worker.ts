import { DrawingPace } from "./drawingPace";
import type { Picture, WorkerMessage, WorkerSetup } from "./picture";
import { Stage } from "./stage";

/**
 * Draws in a worker, because without a graphics card, passing a picture to the screen blocks until it is drawn.
 * The page with Stop must not block.
 */
class Drawer {
  readonly #stage: Stage;
  readonly #pace: DrawingPace;
  #next: Picture | null = null;
  #drawn: Picture | null = null;
  #timer: ReturnType<typeof setTimeout> | null = null;
  #frame: number | null = null;
  #ready = false;

  constructor({ canvas, side, limits, density }: WorkerSetup) {
    this.#stage = new Stage(canvas, side, limits, density);
    this.#pace = new DrawingPace(this.#stage.inSoftware);
    void this.#stage.prepare().then(() => {
      this.#ready = true;
      this.#schedule();
    });
  }

  show(picture: Picture) {
    this.#next = picture;
    this.#schedule();
  }

  #schedule() {
    // The frame that is already requested will draw the newest picture.
    if (!this.#ready || this.#next === null || this.#frame !== null) return;
    // An unknown pose, and another view or colour scheme that the user has chosen, are drawn without throttling.
    if (this.#drawn && (!sameLook(this.#next, this.#drawn) || (this.#drawn.real && !this.#next.real)))
      this.#requestFrame();
    else this.#timer ??= setTimeout(() => this.#requestFrame(), this.#pace.wait_ms(performance.now()));
  }

  #requestFrame() {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#frame = requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#frame = null;
    this.#timer = null;
    const picture = this.#next;
    if (picture === null) return;
    const from = performance.now();
    this.#stage.draw(picture);
    this.#pace.record(from, performance.now());
    this.#next = null;
    this.#drawn = picture;
    send({ drawn: picture.number });
  }
}

/** True if view and scheme are the same. The views are compared by value, because every message is a copy. */
const sameLook = (one: Picture, other: Picture) =>
  one.scheme === other.scheme && JSON.stringify(one.view) === JSON.stringify(other.view);

function send(message: WorkerMessage) {
  self.postMessage(message);
}

function begin(setup: WorkerSetup): Drawer | null {
  setup.canvas.addEventListener("webglcontextlost", () => send({ unable: true }));
  try {
    return new Drawer(setup);
  } catch {
    send({ unable: true });
    return null;
  }
}

self.addEventListener(
  "message",
  ({ data }: MessageEvent<WorkerSetup>) => {
    const drawer = begin(data);
    self.addEventListener("message", ({ data }: MessageEvent<Picture>) => drawer?.show(data));
  },
  { once: true },
);
