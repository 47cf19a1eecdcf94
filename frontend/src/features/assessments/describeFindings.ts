import type { Assessment, Schemas } from "../../lib/api/client";
import { changeAsShown, formatDeg, formatMeasured } from "../../lib/format";
import { t } from "../../lib/i18n";
import { angleKey, PAIN_NAMES, type Side } from "./draft";
import { formatScore, measureName } from "./messages";
import { spadiLimits, spadiMeaning } from "./spadiMeaning";

/** Return 3 as "+3" and -3 as "−3", followed by `unit`; empty without a baseline. */
function formatChange(value: number, first: number | null | undefined, unit = ""): string {
  if (first === null || first === undefined) return "";
  const change = changeAsShown(first, value);
  if (change === 0) return t("assessments:found.unchanged");
  return change > 0
    ? t("assessments:found.more", { by: formatMeasured(change), unit })
    : t("assessments:found.less", { by: formatMeasured(-change), unit });
}

/** The columns of the measured angles: both shoulders, actively and passively. */
export const ROM_COLUMNS = [
  { shoulder: "affected", kind: "active" },
  { shoulder: "affected", kind: "passive" },
  { shoulder: "other", kind: "active" },
  { shoulder: "other", kind: "passive" },
] as const;

/**
 * Return the measured motions with their angles by column, or "" where nothing was measured. Angles of the
 * affected shoulder have the change since the baseline.
 */
export function describeRom(
  assessment: Assessment,
  baseline: Assessment | null,
  measures: Schemas["RomMeasure"][],
  affected: Side,
): { motion: string; angles: string[] }[] {
  const first = new Map(baseline?.rom.map((entry) => [angleKey(entry), entry.angle_deg]));
  const other = affected === "left" ? "right" : "left";
  return measures
    .map((measure) => ({
      motion: measureName(measure),
      angles: ROM_COLUMNS.map(({ shoulder, kind }) => {
        const side = shoulder === "affected" ? affected : other;
        const key = angleKey({ side, motion: measure.motion, position: measure.position, kind });
        const entry = assessment.rom.find((candidate) => angleKey(candidate) === key);
        if (!entry) return "";
        const change = shoulder === "affected" ? formatChange(entry.angle_deg, first.get(key), "°") : "";
        return t("assessments:found.angle", { angle: formatMeasured(entry.angle_deg), changed: change });
      }),
    }))
    .filter(({ angles }) => angles.some((angle) => angle !== ""));
}

export function describePain(assessment: Assessment, baseline: Assessment | null): string | null {
  const parts = PAIN_NAMES.flatMap((name) => {
    const pain = assessment[name];
    return pain === null
      ? []
      : [t(`assessments:found.pain.${name}`, { value: pain, changed: formatChange(pain, baseline?.[name]) })];
  });
  return parts.length > 0 ? t("assessments:found.pains", { pains: parts }) : null;
}

export function describeSpadi(
  assessment: Assessment,
  baseline: Assessment | null,
  form: Schemas["AssessmentForm"],
): string | null {
  if (!assessment.spadi_score) return null;
  const { total } = assessment.spadi_score;
  if (total === null) return t("assessments:found.spadiUnanswered");
  const totalText = formatScore(total);
  const painText = formatScore(assessment.spadi_score.pain);
  const disability = formatScore(assessment.spadi_score.disability);
  const first = baseline?.spadi_score?.total;
  if (first === null || first === undefined)
    return t("assessments:found.spadi", { total: totalText, pain: painText, disability });
  return t("assessments:found.spadiSince", {
    total: totalText,
    pain: painText,
    disability,
    changed: formatChange(total, first),
    verdict: rateSpadiChange(changeAsShown(first, total), form),
  });
}

/** Rate a shown change of the SPADI, with the limits. */
export function rateSpadiChange(change: number, form: Schemas["AssessmentForm"]): string {
  return t(`assessments:found.${spadiMeaning(change, form)}`, spadiLimits(form));
}

/** Return the totals of questionnaires other than the SPADI in words. */
export function describeQuestionnaires(assessment: Assessment): string[] {
  return (assessment.questionnaires ?? []).map(({ title, total_points, highest_points, is_t_score }) => {
    if (total_points === null) return t("assessments:found.questionnaireUnanswered", { title });
    if (is_t_score)
      return t("assessments:found.questionnaireTScore", { title, tScore: formatDeg(total_points, 1) });
    return t("assessments:found.questionnaire", {
      title,
      total: formatScore(total_points),
      highestTotal: highest_points ?? "–",
    });
  });
}
