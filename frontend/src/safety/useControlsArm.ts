import { useLive } from "../lib/live/hooks";
import { controlsArm } from "./modes";

/** Return true if the motors move or hold the arm, also after a stop. */
export function useControlsArm(): boolean {
  const mode = useLive("mode");
  const stop = useLive("stop");
  return mode !== null && controlsArm({ mode, stop });
}
