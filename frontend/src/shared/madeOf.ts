import type { Recording } from "../api/client";
import { told } from "./told";
import { MADE } from "./words";

/** Of what a recording was made and how, in words; null for one that was taught. */
export function madeOf(recording: Recording, others: Recording[]): string | null {
  if (recording.parent_id === null) return null;
  const parent = others.find((one) => one.id === recording.parent_id);
  const done = told(recording.done.at(-1) ?? MADE.changed);
  return parent ? MADE.of(parent.name, done) : MADE.ofAnother(done);
}
