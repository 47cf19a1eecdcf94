import type { Live } from "../lib/api/client";
import { t } from "../lib/i18n";

type Torque = Live["torque"];

/**
 * Return the apparatus state in the therapist's words. After a stop they include the torque. A stop counts as held,
 * too, while the torque is unknown, and then the words say that it is unknown.
 */
export function describeMode(live: Pick<Live, "mode" | "stop" | "run"> & { torque: Torque | null }): string {
  if (live.mode === "stopped") return describeStopped(live.torque ?? "unknown", live.stop?.arm_held === true);
  if (live.mode === "playing" && live.run?.reversing) return t("common:modes.reversing");
  return t(`common:modes.${live.mode}`);
}

function describeStopped(torque: Torque, armHeld: boolean): string {
  if (torque === "unknown") return t("common:modes.stoppedUnknown");
  if (armHeld) return t("common:modes.holding");
  return torque === "on" ? t("common:modes.stoppedOn") : t("common:modes.stopped");
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** Return true if a run moves the arm, or holds it in a pause. After a stop see {@link controlsArm}. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);

/** Return true if the motors move or hold the arm, also after a stop. */
export const controlsArm = ({ mode, stop }: Pick<Live, "mode" | "stop">): boolean =>
  isMoving(mode) || (mode === "stopped" && stop?.arm_held === true);
