import type { Recording } from "../api/client";

/** Of what a recording was made and how, in words; null for one that was taught. */
export function madeOf(recording: Recording, others: Recording[]): string | null {
  if (recording.parent_id === null) return null;
  const parent = others.find((one) => one.id === recording.parent_id);
  return `Made of ${parent?.name ?? "another recording"}: ${recording.done.at(-1) ?? "changed"}`;
}
