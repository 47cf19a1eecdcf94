import type { Schemas } from "../../lib/api/client";
import type { Angles } from "./posture";

/** Where the motors stand over time, seconds from 0 and degrees. */
export type Motion = Pick<Schemas["MotionPreview"], "times_s" | "angles_deg">;

/** The angles at a time, straight between two samples; before the first and after the last it stands. */
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

/** Something that has five angles, and tells when it has others. Frames go through here, never through React. */
export interface AnglesSource {
  /** Null while nobody knows. */
  get: () => Angles | null;
  subscribe: (listener: () => void) => () => void;
}

/** What the ghost needs of a computer: the time in seconds, and to be called again soon. */
export interface Ticking {
  now_s: () => number;
  /** Calls again and again until it is told to end. */
  every: (tick: () => void) => () => void;
}

const TICK_MS = 50;

export const TICKING: Ticking = {
  now_s: () => performance.now() / 1000,
  every: (tick) => {
    const timer = setInterval(tick, TICK_MS);
    return () => clearInterval(timer);
  },
};

/** Plays a motion at its own time, for the eye only: nothing of it goes to the apparatus. */
export class Ghost implements AnglesSource {
  readonly duration_s: number;
  readonly #motion: Motion;
  readonly #ticking: Ticking;
  #listeners = new Set<() => void>();
  /** Where on the motion it was when it was last started, stopped or moved, and when that was. */
  #from_s = 0;
  #since_s = 0;
  #end: (() => void) | null = null;

  constructor(motion: Motion, ticking: Ticking = TICKING) {
    this.#motion = motion;
    this.#ticking = ticking;
    this.duration_s = motion.times_s.at(-1) ?? 0;
  }

  /** Where on the motion it is, seconds. */
  at_s(): number {
    if (this.#end === null) return this.#from_s;
    return Math.min(this.duration_s, this.#from_s + this.#ticking.now_s() - this.#since_s);
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

  /** On from where it is; from the beginning where it has come to the end. */
  play() {
    if (this.playing) return;
    if (this.#from_s >= this.duration_s) this.#from_s = 0;
    this.#since_s = this.#ticking.now_s();
    this.#end = this.#ticking.every(() => this.#tick());
    this.#tell();
  }

  pause() {
    this.#from_s = this.at_s();
    this.#end?.();
    this.#end = null;
    this.#tell();
  }

  /** To a place on the motion, seconds; it plays on from there if it did. */
  seek(at_s: number) {
    this.#from_s = Math.min(this.duration_s, Math.max(0, at_s));
    this.#since_s = this.#ticking.now_s();
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
