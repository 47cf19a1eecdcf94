import type { Alarm, Priority } from "./alarms";

export const SOUND_PAUSE_MS = 120_000;

/** Start times of a burst's pulses, the length of a pulse, and the time until the next burst starts. */
interface Burst {
  pulseStarts_s: number[];
  pulse_s: number;
  repeat_s: number;
}

/** Pulse rhythms of IEC 60601-1-8 (10, 3 and 2 pulses). More urgent bursts are shorter and more frequent. */
export const BURSTS: Record<Priority, Burst> = {
  high: { pulseStarts_s: [0, 0.2, 0.4, 0.75, 0.95, 1.7, 1.9, 2.1, 2.45, 2.65], pulse_s: 0.12, repeat_s: 6 },
  medium: { pulseStarts_s: [0, 0.4, 0.8], pulse_s: 0.2, repeat_s: 10 },
  low: { pulseStarts_s: [0, 0.45], pulse_s: 0.2, repeat_s: 30 },
};

const PITCH_HZ = 440;
const LOUDNESS = 0.25;
const RAMP_S = 0.02;

/** Pauses the sound of the alarms that were active when the user paused it. New alarms still sound. */
export class SoundPause {
  #pausedCodes = new Set<string>();
  #until = 0;

  pause(alarms: Alarm[], now: number): void {
    this.#pausedCodes = new Set(alarms.map((alarm) => alarm.code));
    this.#until = now + SOUND_PAUSE_MS;
  }

  resume(): void {
    this.#pausedCodes.clear();
  }

  /** Return the most urgent alarm that is not paused. An alarm that ends and returns counts as new. */
  audible(alarms: Alarm[], now: number): Alarm | null {
    const codes = new Set(alarms.map((alarm) => alarm.code));
    for (const code of [...this.#pausedCodes])
      if (!codes.has(code) || now >= this.#until) this.#pausedCodes.delete(code);
    return alarms.find((alarm) => !this.#pausedCodes.has(alarm.code)) ?? null;
  }

  get paused(): boolean {
    return this.#pausedCodes.size > 0;
  }
}

/** Play one burst with oscillators. */
function playBurst(context: AudioContext, priority: Priority): void {
  const { pulseStarts_s, pulse_s } = BURSTS[priority];
  const start = context.currentTime + 0.05;
  for (const pulse of pulseStarts_s) {
    const tone = context.createOscillator();
    const level = context.createGain();
    // The harmonics of a sawtooth let a listener locate the source.
    tone.type = "sawtooth";
    tone.frequency.value = PITCH_HZ;
    level.gain.setValueAtTime(0, start + pulse);
    level.gain.linearRampToValueAtTime(LOUDNESS, start + pulse + RAMP_S);
    level.gain.setValueAtTime(LOUDNESS, start + pulse + pulse_s - RAMP_S);
    level.gain.linearRampToValueAtTime(0, start + pulse + pulse_s);
    tone.connect(level).connect(context.destination);
    tone.start(start + pulse);
    tone.stop(start + pulse + pulse_s);
  }
}

/** Repeats the burst of the given alarm until the alarm changes or ends. */
export class AlarmSounder {
  #createContext: () => AudioContext;
  #context: AudioContext | null = null;
  #sounding: string | null = null;
  #timer: ReturnType<typeof setTimeout> | null = null;

  constructor(createContext: () => AudioContext = () => new AudioContext()) {
    this.#createContext = createContext;
  }

  /** Start audio after a user gesture, which browsers require. */
  unlockAudio = (): void => {
    this.#context ??= this.#createContext();
    if (this.#context.state === "suspended") void this.#context.resume();
  };

  get isUnlocked(): boolean {
    return this.#context?.state === "running";
  }

  sound(alarm: Alarm | null): void {
    const key = alarm && `${alarm.priority} ${alarm.code}`;
    if (key === this.#sounding) return;
    this.#sounding = key;
    if (this.#timer) clearTimeout(this.#timer);
    this.#timer = null;
    if (alarm) this.#burst(alarm.priority);
  }

  #burst(priority: Priority) {
    if (this.#context?.state === "running") playBurst(this.#context, priority);
    this.#timer = setTimeout(() => this.#burst(priority), 1000 * BURSTS[priority].repeat_s);
  }
}
