import type { Live } from "../lib/api/client";
import { t } from "../lib/i18n";

type Torque = Live["torque"];

/**
 * Return the apparatus state and the torque that the drives report. After a stop of an arm that counts as held because
 * the torque is unknown, the words say that it is unknown.
 */
export function describeMode(live: Pick<Live, "mode" | "stop" | "run"> & { torque: Torque | null }): string {
  const torque = live.torque ?? "unknown";
  return t("common:modes.withTorque", {
    mode: describeActivity(live),
    torqueState: t(`common:torque.${torque}`),
  });
}

function describeActivity({ mode, stop, run, torque }: Parameters<typeof describeMode>[0]): string {
  if (mode === "stopped" && stop?.arm_held && torque === "on") return t("common:modes.holding");
  if (mode === "playing" && run?.reversing) return t("common:modes.reversing");
  return t(`common:modes.${mode}`);
}

const MOVING: Live["mode"][] = ["approaching", "playing", "paused", "returning"];

/** Return true if a run moves the arm, or holds it in a pause. After a stop see {@link controlsArm}. */
export const isMoving = (mode: Live["mode"]): boolean => MOVING.includes(mode);

/** Return true if the motors move or hold the arm, also after a stop. */
export const controlsArm = ({ mode, stop }: Pick<Live, "mode" | "stop">): boolean =>
  isMoving(mode) || (mode === "stopped" && stop?.arm_held === true);
