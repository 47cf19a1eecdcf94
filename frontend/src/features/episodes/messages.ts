import type { Episode } from "../../lib/api/client";
import { t } from "../../lib/i18n";

export type Side = Episode["side"];
const MOTION_NAMES = t("episodes:motionNames", { returnObjects: true });

/** Numbers of the motions of the shoulder joint in Table 2. */
export const SHOULDER_MOTIONS = [3, 4, 5, 6];

/** Return the name of a motion by its number in Table 2. */
export const shoulderMotionName = (motion: number): string => MOTION_NAMES[motion - 1] ?? String(motion);

/** The six basic motions (table 2) and the apparatus's range of each. */
export const MOTIONS = [
  { motion: 1, name: MOTION_NAMES[0], from: -20, to: 20 },
  { motion: 2, name: MOTION_NAMES[1], from: -20, to: 20 },
  { motion: 3, name: MOTION_NAMES[2], from: -20, to: 130 },
  { motion: 4, name: MOTION_NAMES[3], from: 0, to: 120 },
  { motion: 5, name: MOTION_NAMES[4], from: -20, to: 190 },
  { motion: 6, name: MOTION_NAMES[5], from: -90, to: 40 },
] as const;

/** The diagnoses that can be chosen, by ICD-10 code. */
export const DIAGNOSES: { value: Exclude<Episode["diagnosis_code"], "">; label: string }[] = [
  { value: "M75.0", label: t("episodes:diagnoses.adhesiveCapsulitis") },
  { value: "M75.1", label: t("episodes:diagnoses.rotatorCuff") },
  { value: "M75.2", label: t("episodes:diagnoses.bicipitalTendinitis") },
  { value: "M75.3", label: t("episodes:diagnoses.calcificTendinitis") },
  { value: "M75.4", label: t("episodes:diagnoses.impingement") },
  { value: "M75.5", label: t("episodes:diagnoses.bursitis") },
  { value: "S42.2", label: t("episodes:diagnoses.humerusFracture") },
  { value: "S43.0", label: t("episodes:diagnoses.dislocation") },
];

export const CERTAINTIES: { value: Exclude<Episode["verification"], "">; label: string }[] = [
  { value: "unconfirmed", label: t("episodes:certainties.unconfirmed") },
  { value: "provisional", label: t("episodes:certainties.provisional") },
  { value: "differential", label: t("episodes:certainties.differential") },
  { value: "confirmed", label: t("episodes:certainties.confirmed") },
];

/** Return the diagnosis as it was chosen and written; empty if there is none. */
export function describeDiagnosis(episode: Episode): string {
  const chosen = DIAGNOSES.find(({ value }) => value === episode.diagnosis_code)?.label ?? "";
  if (!chosen || !episode.diagnosis) return chosen || episode.diagnosis;
  return t("episodes:care.chosenAndWritten", { chosen, written: episode.diagnosis });
}

export type StageName = NonNullable<Episode["stage"]>["stage"];

/** Return a whole angle with a typographic minus sign. */
export const minus = (value: number) => String(value).replace("-", "−");

/** Return "Abduction / adduction of the shoulder: 0 to 90°", or a text with only one end. */
export function describeLimit({ motion, lowest_deg, highest_deg }: Episode["limits"][number]): string {
  const name =
    MOTIONS.find((known) => known.motion === motion)?.name ?? t("episodes:limits.unknownMotion", { motion });
  if (lowest_deg === null || lowest_deg === undefined)
    return t("episodes:limits.atMost", { motion: name, highest: minus(highest_deg ?? 0) });
  if (highest_deg === null || highest_deg === undefined)
    return t("episodes:limits.atLeast", { motion: name, lowest: minus(lowest_deg) });
  return t("episodes:limits.between", {
    motion: name,
    lowest: minus(lowest_deg),
    highest: minus(highest_deg),
  });
}
