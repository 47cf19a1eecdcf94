import type { Live } from "../api/client";

/** What the apparatus does, in the therapist's words. */
export const MODE_WORDS: Record<Live["mode"], string> = {
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
