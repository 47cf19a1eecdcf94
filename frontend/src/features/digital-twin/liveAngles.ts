import { isAlive, store } from "../../lib/live/store";
import type { AnglesSource } from "./ghost";
import type { Angles } from "./posture";

/**
 * The motors' measured angles from the store. Outdated angles are kept, and the viewer greys them. Unknown
 * angles are null.
 */
export const liveAngles: AnglesSource = {
  get: () => {
    const axes = store.get().live?.axes;
    const angles = axes?.map((axis) => axis.measured_deg) ?? [];
    return angles.length === 5 && angles.every((angle) => angle !== null)
      ? (angles as unknown as Angles)
      : null;
  },
  subscribe: (listener) => {
    let axes: unknown = null;
    let alive: boolean | null = null;
    return store.subscribe(() => {
      const state = store.get();
      if (state.live?.axes === axes && isAlive(state) === alive) return;
      axes = state.live?.axes;
      alive = isAlive(state);
      listener();
    });
  },
};
