import type { Schemas } from "../../lib/api/client";
import type { Angles } from "./posture";

/** Motor angles over time, in seconds from 0 and degrees. */
export type Motion = Pick<Schemas["MotionPreview"], "times_s" | "angles_deg">;

/** Return the angles at a time, interpolated linearly and constant outside the motion. */
export function anglesAt(motion: Motion, at_s: number): Angles {
  const { times_s, angles_deg } = motion;
  let [low, high] = [0, times_s.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((times_s[middle] as number) <= at_s) low = middle;
    else high = middle;
  }
  const [from_s, to_s] = [times_s[low] as number, times_s[high] as number];
  const share = to_s > from_s ? Math.min(1, Math.max(0, (at_s - from_s) / (to_s - from_s))) : 0;
  const [from, to] = [angles_deg[low] as number[], angles_deg[high] as number[]];
  return from.map((angle, axis) => angle + share * ((to[axis] as number) - angle)) as unknown as Angles;
}

/** A source of five angles that notifies listeners of changes. The angles do not go through React. */
export interface AnglesSource {
  /** Null while unknown. */
  get: () => Angles | null;
  subscribe: (listener: () => void) => () => void;
}

/** The clock of the ghost: the time in seconds and a frame callback. */
export interface GhostClock {
  now_s: () => number;
  /** Call `tick` every frame until the returned function is called. */
  every: (tick: () => void) => () => void;
}

const TICK_MS = 50;

const GHOST_CLOCK: GhostClock = {
  now_s: () => performance.now() / 1000,
  every: (tick) => {
    const timer = setInterval(tick, TICK_MS);
    return () => clearInterval(timer);
  },
};

/** Plays a motion in real time, only on the screen. It sends nothing to the apparatus. */
export class Ghost implements AnglesSource {
  readonly duration_s: number;
  readonly #motion: Motion;
  readonly #clock: GhostClock;
  #listeners = new Set<() => void>();
  /** Position on the motion at the last start, stop or seek, and the time of that action. */
  #from_s = 0;
  #since_s = 0;
  #end: (() => void) | null = null;

  constructor(motion: Motion, ticking: GhostClock = GHOST_CLOCK) {
    this.#motion = motion;
    this.#clock = ticking;
    this.duration_s = motion.times_s.at(-1) ?? 0;
  }

  /** Return the position on the motion in seconds. */
  at_s(): number {
    if (this.#end === null) return this.#from_s;
    return Math.min(this.duration_s, this.#from_s + this.#clock.now_s() - this.#since_s);
  }

  get playing(): boolean {
    return this.#end !== null;
  }

  get = (): Angles => anglesAt(this.#motion, this.at_s());

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => {
      this.#listeners.delete(listener);
    };
  };

  /** Continue from the position, or start again from the beginning if the position is at the end. */
  play() {
    if (this.playing) return;
    if (this.#from_s >= this.duration_s) this.#from_s = 0;
    this.#since_s = this.#clock.now_s();
    this.#end = this.#clock.every(() => this.#tick());
    this.#tell();
  }

  pause() {
    this.#from_s = this.at_s();
    this.#end?.();
    this.#end = null;
    this.#tell();
  }

  /** Move to a position in seconds. A playing ghost continues from there. */
  seek(at_s: number) {
    this.#from_s = Math.min(this.duration_s, Math.max(0, at_s));
    this.#since_s = this.#clock.now_s();
    this.#tell();
  }

  #tick() {
    if (this.at_s() >= this.duration_s) this.pause();
    else this.#tell();
  }

  #tell() {
    for (const listener of this.#listeners) listener();
  }
}

/** Another motion that is shown together with the ghost's motion. Both have the same clock. */
export class Companion implements AnglesSource {
  readonly subscribe: AnglesSource["subscribe"];
  readonly #motion: Motion;
  readonly #ghost: Ghost;

  constructor(motion: Motion, ghost: Ghost) {
    this.#motion = motion;
    this.#ghost = ghost;
    this.subscribe = ghost.subscribe;
  }

  get = (): Angles => anglesAt(this.#motion, this.#ghost.at_s());
}
