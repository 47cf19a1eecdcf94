import type { Schemas } from "../../lib/api/client";
import { formatList } from "../../lib/format";
import { t } from "../../lib/i18n";

/** The settings of a playback. */
export type Settings = Pick<
  Schemas["LoadRequest"],
  "speed_percent" | "repetitions" | "pause_s" | "range_percent" | "method"
>;
/** The settings of a run. Runs of versions without methods have no method. */
type RunSettings = Omit<Settings, "method"> & { method: Settings["method"] | null };

export const AS_TAUGHT: Settings = {
  speed_percent: 100,
  repetitions: 1,
  pause_s: 0,
  range_percent: 100,
  method: "smooth",
};

/** Return the differences from the taught motion in words, or null if there are none. */
export function describeSettings(settings: RunSettings): string | null {
  const words: string[] = [];
  if (settings.range_percent !== 100)
    words.push(t("station:settings.ofTheRange", { percent: settings.range_percent }));
  if (settings.speed_percent !== 100)
    words.push(t("station:settings.ofTheSpeed", { percent: settings.speed_percent }));
  if (settings.repetitions !== 1) words.push(t("station:settings.times", { count: settings.repetitions }));
  if (settings.repetitions !== 1 && settings.pause_s !== 0)
    words.push(t("station:settings.pauses", { seconds: settings.pause_s }));
  if (settings.method === "learned") words.push(t("station:settings.byLearning"));
  if (settings.method === "paper") words.push(t("station:settings.asInThePaper"));
  return words.length > 0 ? formatList(words) : null;
}

/**
 * Return the settings of the recording's newest playback, or null if it has none. Tests of the end-feel and
 * stretches have fixed settings.
 */
export function lastSettings(
  runs: (RunSettings & Pick<Schemas["Run"], "recording_id" | "end_feel">)[],
  recordingId: string | null,
): Settings | null {
  const last = runs.findLast((run) => run.recording_id === recordingId && !run.end_feel);
  if (!last) return null;
  return settingsOf(last);
}

/** Return the settings of an item or a run. */
export function settingsOf(settings: RunSettings): Settings {
  const { speed_percent, repetitions, pause_s, range_percent, method } = settings;
  return { speed_percent, repetitions, pause_s, range_percent, method: method ?? "smooth" };
}
