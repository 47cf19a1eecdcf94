import type { Live } from "../lib/api/client";
import { t } from "../lib/i18n";

/** Return the apparatus state in the therapist's words. */
export function describeMode(live: Pick<Live, "mode" | "stop" | "run">): string {
  if (live.mode === "stopped" && live.stop?.arm_held) return t("common:modes.holding");
  if (live.mode === "playing" && live.run?.reversing) return t("common:modes.reversing");
  return t(`common:modes.${live.mode}`);
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** Return true if a run moves the arm, or holds it in a pause. After a stop see {@link controlsArm}. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);

/** Return true if the motors move or hold the arm, also after a stop. */
export const controlsArm = ({ mode, stop }: Pick<Live, "mode" | "stop">): boolean =>
  isMoving(mode) || (mode === "stopped" && stop?.arm_held === true);
