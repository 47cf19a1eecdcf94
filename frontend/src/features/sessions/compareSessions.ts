import type { Run, Session } from "../../lib/api/client";
import { changeAsShown, ERROR_DIGITS, formatDeg, formatRange } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";

/** One compared value: that of the other session, that of this session, and the numeric change. */
export type Line = { measure: string; other: string; here: string; change: string };
/** A group of values with the recording as its title. The group of pain scores has no title. */
export type Part = { key: string; title: string; lines: Line[] };

type ComparedSession = Pick<Session, "pain_before" | "pain_during" | "pain_after" | "runs">;

/** Return true if the sessions are known to have treated different shoulders. Their differences are no change. */
export const treatDifferentShoulders = (other: Pick<Session, "side">, here: Pick<Session, "side">) =>
  other.side !== null && here.side !== null && other.side !== here.side;

/** Compare pain and all recordings of two sessions. */
export function compareSessions(other: ComparedSession, here: ComparedSession): Part[] {
  const recordings = new Map(
    [...other.runs, ...here.runs].map((run) => [run.recording_id, run.recording_name]),
  );
  return [
    {
      key: "pain",
      title: t("sessions:comparison.pain"),
      lines: [
        numbers(t("sessions:comparison.before"), other.pain_before, here.pain_before),
        numbers(t("sessions:comparison.during"), other.pain_during, here.pain_during),
        numbers(t("sessions:comparison.after"), other.pain_after, here.pain_after),
      ],
    },
    ...[...recordings].map(([id, title]) => ({
      key: id,
      title,
      lines: ofRecording(lastOf(other.runs, id), lastOf(here.runs, id)),
    })),
  ];
}

/** Return the last comparable run of a recording, or else the last run. */
function lastOf(runs: Run[], recordingId: string): Run | undefined {
  const played = runs.filter((run) => run.recording_id === recordingId);
  return played.findLast((run) => run.comparison) ?? played.at(-1);
}

function ofRecording(other: Run | undefined, here: Run | undefined): Line[] {
  const numbersOf = (measure: string, of: (run: Run) => number | null | undefined, digits = 0) =>
    numbers(measure, other && of(other), here && of(here), digits);
  const motions = here?.comparison?.motions ?? other?.comparison?.motions ?? [];
  return [
    numbersOf(t("sessions:comparison.repetitions"), (run) => run.repetitions_done),
    numbersOf(t("sessions:comparison.range"), (run) => run.range_percent),
    numbersOf(t("sessions:comparison.smallestRange"), (run) => run.least_range_percent),
    numbersOf(t("sessions:comparison.level"), (run) => run.resistance_level),
    numbersOf(t("sessions:comparison.takenBack"), (run) => run.reversals),
    numbersOf(t("sessions:comparison.rmse"), (run) => worst(run, "rmse_deg"), ERROR_DIGITS),
    numbersOf(t("sessions:comparison.peak"), (run) => worst(run, "peak_deg"), ERROR_DIGITS),
    ...motions.map((motion) => {
      const reached = (run: Run | undefined) => {
        const same = run?.comparison?.motions.find((compared) => compared.motion === motion.motion);
        return formatRange(same?.played_min_deg ?? null, same?.played_max_deg ?? null);
      };
      const measure = t("sessions:comparison.reached", {
        motion: t("sessions:compared.motionNamed", {
          number: motion.motion,
          name: translateServerText(motion.name, motion.name_key),
        }),
      });
      return { measure, other: reached(other), here: reached(here), change: "" };
    }),
  ];
}

/** Return the largest absolute error of all motors, or null for a partial comparison. */
function worst(run: Run, figure: "rmse_deg" | "peak_deg"): number | null {
  const motors = run.partial ? [] : (run.comparison?.motors ?? []);
  return motors.length > 0 ? Math.max(...motors.map((motor) => Math.abs(motor[figure]))) : null;
}

function numbers(
  measure: string,
  other: number | null | undefined,
  here: number | null | undefined,
  digits = 0,
): Line {
  const isKnown = typeof other === "number" && typeof here === "number";
  const change = isKnown ? changeAsShown(other, here, digits) : null;
  const sign = change !== null && change > 0 ? "+" : "";
  return {
    measure,
    other: formatDeg(other, digits),
    here: formatDeg(here, digits),
    change: change === null ? "" : sign + formatDeg(change, digits),
  };
}
