import type { Assessment, Schemas } from "../../../lib/api/client";
import { changeAsShown } from "../../../lib/format";
import { angleKey } from "../../assessments/draft";

/**
 * Minimum age of last month's assessment. It is four weeks, because most patients are assessed on the same
 * weekday.
 */
const MONTH_MS = 28 * 24 * 3_600_000;

/** The newest assessment, and the one with which it is compared; null if there is none. */
export type Compared = { newest: Assessment; before: Assessment | null };

/**
 * Return the newest assessment, and the last one that is at least four weeks older, or else the first. `items`:
 * newest first; may contain withdrawn ones. `baseline`: the first of all.
 */
export function sinceLastMonth(items: Assessment[], baseline: Assessment | null): Compared | null {
  const counted = items.filter((assessment) => !assessment.withdrawn_at);
  const [newest] = counted;
  if (!newest) return null;
  const latest = Date.parse(newest.assessed_at) - MONTH_MS;
  const before = counted.find((assessment) => Date.parse(assessment.assessed_at) <= latest) ?? baseline;
  return { newest, before: before?.id === newest.id ? null : before };
}

/**
 * One measured value, and its change since the earlier assessment; the change is null if the value was not
 * measured then.
 */
export type Change = { value: number; change: number | null };

/** Return the active angle of a motion and its change, or null if the angle is not measured now. */
export function angleChange(
  { newest, before }: Compared,
  side: "left" | "right",
  { motion, position }: Schemas["RomMeasure"],
): Change | null {
  const key = angleKey({ side, motion, position, kind: "active" });
  const angle = (assessment: Assessment | null) =>
    assessment?.rom.find((entry) => angleKey(entry) === key)?.angle_deg;
  return changeOf(angle(newest), angle(before));
}

/** Return the average pain, or else the pain on active movement, with its name and change. */
export function painChange({ newest, before }: Compared) {
  for (const name of ["pain_average", "pain_active"] as const) {
    const change = changeOf(newest[name], before?.[name]);
    if (change) return { name, ...change };
  }
  return null;
}

export function spadiChange({ newest, before }: Compared): Change | null {
  return changeOf(newest.spadi_score?.total, before?.spadi_score?.total);
}

function changeOf(value: number | null | undefined, before: number | null | undefined): Change | null {
  if (value === null || value === undefined) return null;
  return { value, change: before === null || before === undefined ? null : changeAsShown(before, value) };
}
