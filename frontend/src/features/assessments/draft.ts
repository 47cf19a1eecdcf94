import type { Assessment, Schemas } from "../../lib/api/client";
import { fromLocalDateTime, toLocalDateTime } from "../../lib/days";
import { formatDeg, formatMeasured } from "../../lib/format";
import { t } from "../../lib/i18n";
import { measureName } from "./messages";
import type { Answers } from "./spadi";

type Measure = Schemas["RomMeasure"];
type Entry = Schemas["RomEntry"];
export type Side = Entry["side"];
export type Kind = Entry["kind"];
export const KINDS = ["active", "passive"] as const satisfies Kind[];

export const PAIN_NAMES = ["pain_rest", "pain_active", "pain_passive", "pain_average"] as const;
export type Pain = (typeof PAIN_NAMES)[number];

/** An assessment during input. */
export type Draft = {
  /** The clinic's time in the format of the datetime-local field. */
  at: string;
  by: string;
  /** Typed angles, by `angleKey`. */
  rom: Record<string, string>;
  pains: Record<Pain, number | null>;
  spadi: Answers;
  note: string;
};

const SPADI_ITEMS = 13;

/** Return the key of an angle in the draft. */
export const angleKey = (angle: { side: Side; motion: string; position: string; kind: Kind }) =>
  [angle.side, angle.motion, angle.position, angle.kind].join(" ");

export function emptyDraft(now: Date, assessedBy: string): Draft {
  return {
    at: toLocalDateTime(now),
    by: assessedBy,
    rom: {},
    pains: { pain_rest: null, pain_active: null, pain_passive: null, pain_average: null },
    spadi: Array<null>(SPADI_ITEMS).fill(null),
    note: "",
  };
}

export function toDraft(assessment: Assessment): Draft {
  const { pain_rest, pain_active, pain_passive, pain_average } = assessment;
  return {
    at: toLocalDateTime(new Date(assessment.assessed_at)),
    by: assessment.assessed_by,
    rom: Object.fromEntries(assessment.rom.map((entry) => [angleKey(entry), String(entry.angle_deg)])),
    pains: { pain_rest, pain_active, pain_passive, pain_average },
    spadi: assessment.spadi ?? Array<null>(SPADI_ITEMS).fill(null),
    note: assessment.note,
  };
}

/** Return the typed number, null for an empty text, or undefined for an invalid number. */
function typedAngle(text: string): number | null | undefined {
  const normalized = text.trim().replace(",", ".").replace("−", "-");
  if (normalized === "") return null;
  const angle = Number(normalized);
  return Number.isFinite(angle) ? angle : undefined;
}

/** Return a sentence about an invalid angle, or null if it is valid. */
export function angleProblem(measure: Measure, text: string): string | null {
  const angle = typedAngle(text);
  if (angle === null) return null;
  if (angle !== undefined && angle >= measure.lowest_deg && angle <= measure.highest_deg) return null;
  const [lowest, highest] = [formatDeg(measure.lowest_deg, 0), formatDeg(measure.highest_deg, 0)];
  return t("assessments:rom.implausible", { measure: measureName(measure), lowest, highest });
}

/**
 * Return a sentence if the typed angle fits the other zero of its measurement better, else null. A stiff shoulder
 * can also have such a rotation inwards, so there is no sentence if the rotation outwards fits Kata's zero.
 */
export function otherZeroNote(
  measures: Measure[],
  measure: Measure,
  typed: Record<string, string>,
  at: { side: Side; kind: Kind },
): string | null {
  const angle = typedAngle(typed[angleKey({ ...measure, ...at })] ?? "");
  if (!measure.other_zero || typeof angle !== "number") return null;
  if (!fitsOtherZero(measure, angle)) return null;
  const opposite = measures.find(
    (one) => one.position === measure.position && (one.other_zero?.adds_deg ?? 0) > 0,
  );
  if (measure.other_zero.adds_deg < 0 && opposite) {
    const outwards = typedAngle(typed[angleKey({ ...opposite, ...at })] ?? "");
    if (typeof outwards === "number" && !fitsOtherZero(opposite, outwards)) return null;
  }
  return t("assessments:rom.otherZero", {
    measure: t(`assessments:rom.cell.${at.side}.${at.kind}`, { measure: measureName(measure) }),
    angle: formatMeasured(angle),
    counted: formatMeasured(angle - measure.other_zero.adds_deg),
  });
}

function fitsOtherZero({ other_zero }: Measure, angle: number): boolean {
  if (!other_zero) return false;
  return Math.sign(other_zero.adds_deg) * (angle - other_zero.fits_from_deg) > 0;
}

/** Return the request for the service. */
export function toRequest(draft: Draft, measures: Measure[]): Schemas["AssessmentCreate"] {
  const rom: Entry[] = [];
  for (const { motion, position } of measures) {
    for (const side of ["left", "right"] as const) {
      for (const kind of ["active", "passive"] as const) {
        const angle_deg = typedAngle(draft.rom[angleKey({ side, motion, position, kind })] ?? "");
        if (typeof angle_deg === "number") rom.push({ side, motion, position, kind, angle_deg });
      }
    }
  }
  return {
    assessed_at: fromLocalDateTime(draft.at).toISOString(),
    assessed_by: draft.by.trim(),
    rom,
    ...draft.pains,
    spadi: draft.spadi.some((answer) => answer !== null) ? draft.spadi : null,
    note: draft.note,
  };
}
