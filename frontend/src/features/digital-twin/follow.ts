import type { AnglesSource } from "./ghost";
import type { Angles } from "./posture";

/**
 * Smallest visible change: less than a pixel at the hand. A resting arm's angles change by less, so its picture
 * does not change.
 */
const UNSEEN_DEG = 0.2;

/** Call `show` with the source's angles now and after each visible change. Return a function that stops this. */
export function follow(source: AnglesSource | null, show: (angles: Angles | null) => void) {
  let shown = source?.get() ?? null;
  show(shown);
  return source?.subscribe(() => {
    const angles = source.get();
    if (sameToSee(angles, shown)) return;
    shown = angles;
    show(angles);
  });
}

function sameToSee(angles: Angles | null, shown: Angles | null): boolean {
  if (angles === null || shown === null) return angles === shown;
  return angles.every((angle, axis) => Math.abs(angle - (shown[axis] as number)) < UNSEEN_DEG);
}
