import type { Live } from "../lib/api/client";
import { MODES } from "../lib/messages";

/** What the apparatus does, in the therapist's words. */
export function modeWords(live: Pick<Live, "mode" | "stop" | "run">): string {
  if (live.mode === "stopped" && live.stop?.arm_held) return MODES.holding;
  if (live.mode === "playing" && live.run?.reversing) return MODES.reversing;
  return MODES[live.mode];
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** The motors move or hold an arm: somebody operates it. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);
