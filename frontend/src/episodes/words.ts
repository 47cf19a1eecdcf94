import type { Episode } from "../api/client";

/** Table 2: the six basic motions, and how far the apparatus takes each of them. */
export const MOTIONS = [
  { motion: 1, name: "Abduction / adduction of the scapula", from: -20, to: 20 },
  { motion: 2, name: "Upward / downward rotation of the scapula", from: -20, to: 20 },
  { motion: 3, name: "Horizontal flexion / extension of the shoulder", from: -20, to: 130 },
  { motion: 4, name: "Abduction / adduction of the shoulder", from: 0, to: 120 },
  { motion: 5, name: "Flexion / extension of the shoulder", from: -20, to: 190 },
  { motion: 6, name: "External / internal rotation of the shoulder", from: -90, to: 40 },
] as const;

export type StageName = NonNullable<Episode["stage"]>["stage"];

export const STAGES: Record<StageName, string> = {
  freezing: "Freezing",
  frozen: "Frozen",
  thawing: "Thawing",
};

/** "Abduction / adduction of the shoulder: 0 to 90 deg", or only one end of it. */
export function limitWords({ motion, lowest_deg, highest_deg }: Episode["limits"][number]): string {
  const name = MOTIONS.find((one) => one.motion === motion)?.name ?? `Motion ${motion}`;
  const minus = (value: number) => String(value).replace("-", "−");
  if (lowest_deg === null || lowest_deg === undefined)
    return `${name}: no more than ${minus(highest_deg ?? 0)} deg`;
  if (highest_deg === null || highest_deg === undefined)
    return `${name}: no less than ${minus(lowest_deg)} deg`;
  return `${name}: ${minus(lowest_deg)} to ${minus(highest_deg)} deg`;
}

/** Today in this browser, as 2026-11-21. */
export function today(now = new Date()): string {
  const two = (value: number) => String(value).padStart(2, "0");
  return `${now.getFullYear()}-${two(now.getMonth() + 1)}-${two(now.getDate())}`;
}
