import type { Assessment, Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { cell, PAIN_NAMES } from "./draft";
import { FOUND, formatScore, measureName } from "./messages";

/** 3 as "3 more", -3 as "3 less"; nothing where there is no baseline. */
function changed(value: number, first: number | null | undefined): string {
  if (first === null || first === undefined) return "";
  const change = Math.round(value - first);
  if (change === 0) return FOUND.asAtFirst;
  return change > 0 ? FOUND.more(change) : FOUND.less(-change);
}

/** How far the shoulder of a side went, motion by motion, in words; what has changed since the baseline, if there is another. */
export function romWords(
  one: Assessment,
  baseline: Assessment | null,
  measures: Schemas["RomMeasure"][],
  side: "left" | "right",
): string[] {
  const first = new Map(baseline?.rom.map((entry) => [cell(entry), entry.angle_deg]));
  return measures.flatMap((measure) => {
    const { motion, position } = measure;
    const said = (["active", "passive"] as const).flatMap((kind) => {
      const entry = one.rom.find((found) => cell(found) === cell({ side, motion, position, kind }));
      if (!entry) return [];
      const change = changed(entry.angle_deg, first.get(cell(entry)));
      return [FOUND.angle(formatDeg(entry.angle_deg, 0), kind, change)];
    });
    return said.length > 0 ? [FOUND.angles(measureName(measure), said)] : [];
  });
}

export function painWords(one: Assessment, baseline: Assessment | null): string | null {
  const said = PAIN_NAMES.flatMap((name) => {
    const pain = one[name];
    return pain === null ? [] : [FOUND.pain(name, pain, changed(pain, baseline?.[name]))];
  });
  return said.length > 0 ? FOUND.pains(said) : null;
}

export function spadiWords(
  one: Assessment,
  baseline: Assessment | null,
  form: Schemas["AssessmentForm"],
): string | null {
  if (!one.spadi_score) return null;
  const { total } = one.spadi_score;
  if (total === null) return FOUND.spadiUnanswered;
  const whole = formatScore(total);
  const pain = formatScore(one.spadi_score.pain);
  const disability = formatScore(one.spadi_score.disability);
  const first = baseline?.spadi_score?.total;
  if (first === null || first === undefined) return FOUND.spadi(whole, pain, disability);
  return FOUND.spadiSince(whole, pain, disability, changed(total, first), verdict(total - first, form));
}

/** Whether a change of the SPADI matters; less is better. */
function verdict(change: number, form: Schemas["AssessmentForm"]): string {
  const size = Math.abs(change);
  if (size < form.spadi_perhaps_important) return FOUND.unimportant;
  if (size < form.spadi_important) return change < 0 ? FOUND.perhapsBetter : FOUND.perhapsWorse;
  return change < 0 ? FOUND.better : FOUND.worse;
}
