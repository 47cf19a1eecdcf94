import type { Live } from "../lib/api/client";
import { MODES } from "../lib/messages";

/** Describe the apparatus state in the therapist's words. */
export function describeMode(live: Pick<Live, "mode" | "stop" | "run">): string {
  if (live.mode === "stopped" && live.stop?.arm_held) return MODES.holding;
  if (live.mode === "playing" && live.run?.reversing) return MODES.reversing;
  return MODES[live.mode];
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** True if the motors move or hold an arm. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);
