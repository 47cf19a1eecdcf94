import type { Assessment, Schemas } from "../../../lib/api/client";
import { angleKey, type Kind, type Side } from "../../assessments/draft";

type Measure = Schemas["RomMeasure"];
/**
 * The angles of one motion: present angles of both shoulders, and the first angle of the affected one. Null:
 * not measured.
 */
export type RomRow = {
  measure: Measure;
  affected: number | null;
  other: number | null;
  first: number | null;
};

/**
 * Return whether the figure shows a motion: it must be on the first page of the form, and its reference must
 * not be 0.
 */
const isShown = ({ position, motion, reference_deg }: Measure) =>
  (position === "" || position === "at_side") &&
  reference_deg > 0 &&
  !motion.startsWith("scapular") &&
  !motion.startsWith("horizontal");

/** Return the motions that are measured in at least one shoulder, in the form's order. */
export function romRows(
  measures: Measure[],
  newest: Assessment,
  baseline: Assessment | null,
  affected: Side,
  kind: Kind,
): RomRow[] {
  const angle = (assessment: Assessment | null, side: Side, { motion, position }: Measure) =>
    assessment?.rom.find((entry) => angleKey(entry) === angleKey({ side, motion, position, kind }))
      ?.angle_deg ?? null;
  const other = affected === "left" ? "right" : "left";
  return measures
    .filter(isShown)
    .map((measure) => ({
      measure,
      affected: angle(newest, affected, measure),
      other: angle(newest, other, measure),
      first: baseline?.id === newest.id ? null : angle(baseline, affected, measure),
    }))
    .filter((row) => row.affected !== null || row.other !== null);
}

/** Share of the reference at the edge of the figure. */
export const EDGE = 1.2;

/**
 * Return the point of an angle on spoke `n` of `count`, relative to the centre. Angles below 0 are at the
 * centre.
 */
export function radarPoint(
  angle_deg: number,
  reference_deg: number,
  n: number,
  count: number,
  radius: number,
): [x: number, y: number] {
  const share = Math.min(EDGE, Math.max(0, angle_deg / reference_deg));
  const turn = (2 * Math.PI * n) / count - Math.PI / 2;
  return [Math.cos(turn) * share * (radius / EDGE), Math.sin(turn) * share * (radius / EDGE)];
}
