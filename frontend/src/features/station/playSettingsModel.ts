import type { Schemas } from "../../lib/api/client";
import { formatList } from "../../lib/format";
import { t } from "../../lib/i18n";

/** The settings of a playback. */
export type Settings = Pick<
  Schemas["LoadRequest"],
  "speed_percent" | "repetitions" | "pause_s" | "range_percent" | "method"
>;
/** The settings in a run. Runs from before methods existed have no method. */
type Kept = Omit<Settings, "method"> & { method: Settings["method"] | null };

export const AS_TAUGHT: Settings = {
  speed_percent: 100,
  repetitions: 1,
  pause_s: 0,
  range_percent: 100,
  method: "smooth",
};

/** Describe what differs from the taught motion, or return null. */
export function settingsWords(it: Kept): string | null {
  const words: string[] = [];
  if (it.range_percent !== 100) words.push(t("station:settings.ofTheRange", { percent: it.range_percent }));
  if (it.speed_percent !== 100) words.push(t("station:settings.ofTheSpeed", { percent: it.speed_percent }));
  if (it.repetitions !== 1) words.push(t("station:settings.times", { count: it.repetitions }));
  if (it.repetitions !== 1 && it.pause_s !== 0)
    words.push(t("station:settings.pauses", { seconds: it.pause_s }));
  if (it.method === "learned") words.push(t("station:settings.byLearning"));
  if (it.method === "paper") words.push(t("station:settings.asInThePaper"));
  return words.length > 0 ? formatList(words) : null;
}

/** Return the settings of the recording's newest run, or null. */
export function lastSettings(
  runs: (Kept & { recording_id: string })[],
  recordingId: string | null,
): Settings | null {
  const last = runs.findLast((run) => run.recording_id === recordingId);
  if (!last) return null;
  return settingsOf(last);
}

/** Pick the settings of an item or a run. */
export function settingsOf(it: Kept): Settings {
  const { speed_percent, repetitions, pause_s, range_percent, method } = it;
  return { speed_percent, repetitions, pause_s, range_percent, method: method ?? "smooth" };
}
