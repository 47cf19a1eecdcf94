import type { Live } from "../api/client";

const MODE_WORDS: Record<Live["mode"], string> = {
  offline: "Not connected",
  idle: "Idle, torque off",
  teaching: "Teaching, torque off",
  ready: "Recording loaded, torque off",
  approaching: "Moving to the start",
  playing: "Playing",
  paused: "Holding the arm",
  returning: "Moving back",
  stopped: "Stopped",
};

/** What the apparatus does, in the therapist's words. */
export function modeWords(live: Pick<Live, "mode" | "stop" | "run">): string {
  if (live.mode === "stopped" && live.stop?.arm_held) return "Stopped, holding the arm";
  if (live.mode === "playing" && live.run?.reversing) return "Taking the arm back";
  return MODE_WORDS[live.mode];
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** The motors move or hold an arm: somebody operates it. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);
