import type { Alarm, Priority } from "./alarms";

export const PAUSED_MS = 120_000;

/** Beginnings of a burst's pulses in seconds, how long each lasts, and how long after its beginning the next burst begins. */
interface Burst {
  beats_s: number[];
  long_s: number;
  again_s: number;
}

/** In the rhythms of IEC 60601-1-8: five and five pulses, three, two; the more urgent the shorter and the sooner again. */
export const BURSTS: Record<Priority, Burst> = {
  high: { beats_s: [0, 0.2, 0.4, 0.75, 0.95, 1.7, 1.9, 2.1, 2.45, 2.65], long_s: 0.12, again_s: 6 },
  medium: { beats_s: [0, 0.4, 0.8], long_s: 0.2, again_s: 10 },
  low: { beats_s: [0, 0.45], long_s: 0.2, again_s: 30 },
};

const HZ = 440;
const LOUDNESS = 0.25;
const EDGE_S = 0.02;

/** Which alarms sound: all but those that stood when somebody paused the sound, for as long as that lasts. */
export class Pausing {
  #quiet = new Set<string>();
  #until = 0;

  pause(alarms: Alarm[], now: number): void {
    this.#quiet = new Set(alarms.map((alarm) => alarm.code));
    this.#until = now + PAUSED_MS;
  }

  resume(): void {
    this.#quiet.clear();
  }

  /** The most urgent one that is to be heard. An alarm that has gone is a new one when it comes again. */
  heard(alarms: Alarm[], now: number): Alarm | null {
    const codes = new Set(alarms.map((alarm) => alarm.code));
    for (const code of [...this.#quiet]) if (!codes.has(code) || now >= this.#until) this.#quiet.delete(code);
    return alarms.find((alarm) => !this.#quiet.has(alarm.code)) ?? null;
  }

  get paused(): boolean {
    return this.#quiet.size > 0;
  }
}

/** One burst, made of nothing but oscillators. */
function play(context: AudioContext, priority: Priority): void {
  const { beats_s, long_s } = BURSTS[priority];
  const begins = context.currentTime + 0.05;
  for (const beat of beats_s) {
    const tone = context.createOscillator();
    const level = context.createGain();
    // With the harmonics that let an ear tell where it comes from.
    tone.type = "sawtooth";
    tone.frequency.value = HZ;
    level.gain.setValueAtTime(0, begins + beat);
    level.gain.linearRampToValueAtTime(LOUDNESS, begins + beat + EDGE_S);
    level.gain.setValueAtTime(LOUDNESS, begins + beat + long_s - EDGE_S);
    level.gain.linearRampToValueAtTime(0, begins + beat + long_s);
    tone.connect(level).connect(context.destination);
    tone.start(begins + beat);
    tone.stop(begins + beat + long_s);
  }
}

/** Sounds the alarm that it was last told of, burst after burst, until it is told of none. */
export class Sounder {
  #make: () => AudioContext;
  #context: AudioContext | null = null;
  #sounding: string | null = null;
  #again: ReturnType<typeof setTimeout> | null = null;

  constructor(make: () => AudioContext = () => new AudioContext()) {
    this.#make = make;
  }

  /** Somebody has pressed something: from now on a browser lets a page sound. */
  allow = (): void => {
    this.#context ??= this.#make();
    if (this.#context.state === "suspended") void this.#context.resume();
  };

  get allowed(): boolean {
    return this.#context?.state === "running";
  }

  sound(alarm: Alarm | null): void {
    const wanted = alarm && `${alarm.priority} ${alarm.code}`;
    if (wanted === this.#sounding) return;
    this.#sounding = wanted;
    if (this.#again) clearTimeout(this.#again);
    this.#again = null;
    if (alarm) this.#burst(alarm.priority);
  }

  #burst(priority: Priority) {
    if (this.#context?.state === "running") play(this.#context, priority);
    this.#again = setTimeout(() => this.#burst(priority), 1000 * BURSTS[priority].again_s);
  }
}
