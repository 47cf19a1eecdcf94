import type { Recording } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";

/** Return the edits of a recording in words, in order. */
export const describeEdits = (recording: Pick<Recording, "done" | "done_keys">): string[] =>
  recording.done.map((text, index) => translateServerText(text, recording.done_keys[index]));

/** Return the origin and the edits of a recording in words, or null for a taught recording. */
export function describeOrigin(recording: Recording, others: Recording[]): string | null {
  if (recording.parent_id === null) return null;
  const parent = others.find((other) => other.id === recording.parent_id);
  const done = describeEdits(recording).at(-1) ?? t("common:made.changed");
  return parent ? t("common:made.of", { parent: parent.name, done }) : t("common:made.ofAnother", { done });
}
