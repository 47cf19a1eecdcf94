import type { Run, Session } from "../../lib/api/client";
import { describePatientAngle } from "./patientAngle";

type ShoulderRuns = Pick<Session, "side" | "runs">;

export type VerdictName = "none" | "open" | "completed" | "shortened" | "stopped" | "interrupted";
type Motion = NonNullable<Run["comparison"]>["motions"][number];

/** Return how the session went: the worst outcome of its playbacks, or that it has not ended. */
export function verdictOf({ runs, ended_at, end_reason }: Session): VerdictName {
  const outcomes = runs.map(({ outcome }) => outcome);
  if (outcomes.includes("stopped")) return "stopped";
  if (outcomes.includes("interrupted")) return "interrupted";
  if (ended_at === null) return "open";
  if (!outcomes.some((outcome) => outcome === "completed" || outcome === "returned")) return "none";
  const shortened = end_reason !== null && end_reason !== "completed";
  return shortened || outcomes.includes("returned") ? "shortened" : "completed";
}

/** The largest absolute error of the session, with its motor and the index of its playback. */
type WorstError = { runIndex: number; motor: number; peak_deg: number };

/**
 * Return the largest error, or null if nothing was compared. Partial comparisons are ignored, as in the
 * progress charts.
 */
export function worstError(runs: Run[]): WorstError | null {
  const errors = runs.flatMap((run, runIndex) =>
    run.partial
      ? []
      : (run.comparison?.motors ?? []).map(({ motor, peak_deg }) => ({ runIndex, motor, peak_deg })),
  );
  return errors.reduce<WorstError | null>(
    (worst, error) => (worst && Math.abs(worst.peak_deg) >= Math.abs(error.peak_deg) ? worst : error),
    null,
  );
}

/** Return the motor with the run's largest error; 1 if nothing was compared. */
export const worstMotor = (run: Run): number => worstError([{ ...run, partial: false }])?.motor ?? 1;

/** A motion with the angles reached and requested, over all playbacks. */
type Reached = {
  motion: Motion;
  reached: [number, number];
  requested: [number, number];
  /** The playback that reached lowest, and the one that reached highest. */
  ends: [Motion, Motion];
  /** The patient's angles at both ends; null if only the apparatus angle is known. */
  patient: string | null;
};

/**
 * Return the motion of the treated shoulder with the widest range in apparatus angles, or null if nothing was
 * compared.
 */
export function widestRange(session: ShoulderRuns): Reached | null {
  const found = new Map<number, Reached>();
  for (const motion of motionsOf(session)) {
    const { played_min_deg, played_max_deg, taught_min_deg, taught_max_deg } = motion;
    if (played_min_deg === null || played_max_deg === null) continue;
    const requested: [number, number] = [taught_min_deg ?? played_min_deg, taught_max_deg ?? played_max_deg];
    const before = found.get(motion.motion);
    const lowest = before && before.reached[0] <= played_min_deg ? before.ends[0] : motion;
    const highest = before && before.reached[1] >= played_max_deg ? before.ends[1] : motion;
    found.set(motion.motion, {
      motion,
      reached: wider(before?.reached, [played_min_deg, played_max_deg]),
      requested: wider(before?.requested, requested),
      ends: [lowest, highest],
      patient: describePatientAngle(lowest, highest),
    });
  }
  const span = ({ reached: [from, to] }: Reached) => to - from;
  return [...found.values()].reduce<Reached | null>(
    (widest, next) => (widest && span(widest) >= span(next) ? widest : next),
    null,
  );
}

/** Return the compared motions of the treated shoulder. A recording of the other shoulder does not describe it. */
function motionsOf({ side, runs }: ShoulderRuns): Motion[] {
  return runs
    .filter((run) => !side || !run.side || run.side === side)
    .flatMap((run) => run.comparison?.motions ?? []);
}

function wider(before: [number, number] | undefined, next: [number, number]): [number, number] {
  return before ? [Math.min(before[0], next[0]), Math.max(before[1], next[1])] : next;
}

/** End-range time of one motion over all playbacks, with the band and the torque that count. */
type EndRange = { motion: Motion; total_s: number; band_deg: number; torque_nm: number };

/**
 * Return the motion of the treated shoulder with the longest end-range time, or null if none was counted. Times
 * with different bands or torques do not add up.
 */
export function longestEndRange(session: ShoulderRuns): EndRange | null {
  const found = new Map<string, EndRange>();
  for (const motion of motionsOf(session)) {
    const { end_range_s, end_range_band_deg: band_deg, end_range_torque_nm: torque_nm } = motion;
    if (end_range_s == null || band_deg == null || torque_nm == null) continue;
    const key = [motion.motion, band_deg, torque_nm].join();
    const total_s = (found.get(key)?.total_s ?? 0) + end_range_s;
    found.set(key, { motion, total_s, band_deg, torque_nm });
  }
  return [...found.values()].reduce<EndRange | null>(
    (longest, next) => (longest && longest.total_s >= next.total_s ? longest : next),
    null,
  );
}

/** Return the sum of a count over the playbacks that have it, or null if none has it. */
export function total(runs: Run[], of: (run: Run) => number | null): number | null {
  const counts = runs.map(of).filter((count) => count !== null);
  return counts.length > 0 ? counts.reduce((sum, count) => sum + count, 0) : null;
}
