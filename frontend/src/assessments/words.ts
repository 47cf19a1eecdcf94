import type { Assessment, Schemas } from "../api/client";
import { formatDeg } from "../shared/format";
import { cell, PAINS } from "./draft";

/** A score of 0 to 100; a dash where there is none. */
export const formatScore = (value: number | null | undefined) => formatDeg(value, 0);

/** 12 as "12 more", -3 as "3 less"; nothing where there is no baseline. */
function changed(value: number, first: number | null | undefined): string {
  if (first === null || first === undefined) return "";
  const change = Math.round(value - first);
  if (change === 0) return " (as at first)";
  return ` (${Math.abs(change)} ${change > 0 ? "more" : "less"})`;
}

/** How far the shoulder of a side went, motion by motion, in words; what has changed since the baseline, if there is another. */
export function romWords(
  one: Assessment,
  baseline: Assessment | null,
  measures: Schemas["RomMeasure"][],
  side: "left" | "right",
): string[] {
  const first = new Map(baseline?.rom.map((entry) => [cell(entry), entry.angle_deg]));
  return measures.flatMap(({ motion, position, name }) => {
    const said = (["active", "passive"] as const).flatMap((kind) => {
      const entry = one.rom.find((found) => cell(found) === cell({ side, motion, position, kind }));
      if (!entry) return [];
      return [`${formatDeg(entry.angle_deg, 0)}° ${kind}${changed(entry.angle_deg, first.get(cell(entry)))}`];
    });
    return said.length > 0 ? [`${name}: ${said.join(", ")}`] : [];
  });
}

export function painWords(one: Assessment, baseline: Assessment | null): string | null {
  const said = PAINS.flatMap(({ name, label }) => {
    const pain = one[name];
    return pain === null ? [] : [`${label.toLowerCase()} ${pain}${changed(pain, baseline?.[name])}`];
  });
  return said.length > 0 ? `Pain of 10: ${said.join(", ")}` : null;
}

export function spadiWords(
  one: Assessment,
  baseline: Assessment | null,
  form: Schemas["AssessmentForm"],
): string | null {
  if (!one.spadi_score) return null;
  const { total, pain, disability } = one.spadi_score;
  if (total === null) return "SPADI: too much was left unanswered for a score";
  const halves = `pain ${formatScore(pain)}, disability ${formatScore(disability)}`;
  const first = baseline?.spadi_score?.total;
  if (first === null || first === undefined) return `SPADI ${formatScore(total)} of 100: ${halves}`;
  return `SPADI ${formatScore(total)} of 100${changed(total, first)}: ${halves}. ${verdict(total - first, form)}`;
}

/** Whether a change of the SPADI matters; less is better. */
function verdict(change: number, form: Schemas["AssessmentForm"]): string {
  const size = Math.abs(change);
  if (size < form.spadi_perhaps_important) return "No important change";
  const direction = change < 0 ? "improvement" : "worsening";
  return size < form.spadi_important ? `Perhaps an important ${direction}` : `An important ${direction}`;
}
