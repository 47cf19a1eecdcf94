import "./catalogue";
import type { ProgrammeItem, ProgrammeVersion, Schemas } from "../../lib/api/client";
import { formatDuration, totalDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { shoulderMotionName } from "../episodes/messages";
import { describeSettings } from "../station/playSettingsModel";
import { RESISTANCE_LEVELS } from "../station/resistanceLevels";

/** A playback setting that a programme prescribes. */
export type Setting = Schemas["PlannedRun"]["changed"][number];

/** Return a text for the middle of a sentence, with a small first letter. */
export const lower = (text: string) => text.charAt(0).toLowerCase() + text.slice(1);

/** The playback settings of a programme item. */
export type ItemSettings = Pick<ProgrammeItem, Setting>;
/** The settings of a run. A run of an older version may lack some. */
type PlayedSettings = Omit<ItemSettings, "resistance_level" | "method"> &
  Pick<Schemas["PlannedRun"], "resistance_level" | "method">;

/** A prescribed end-range time of one motion. */
export type EndRangePrescription = Required<Schemas["EndRangePrescription"]>;

const NAMES: Setting[] = [
  "range_percent",
  "speed_percent",
  "repetitions",
  "pause_s",
  "resistance_level",
  "method",
  "self_paced",
];

/** Describe an item's settings. */
export function describeItem(item: PlayedSettings): string {
  const played = describeSettings(item) ?? t("programmes:played.asTaught");
  const settings = item.self_paced ? t("programmes:played.selfPaced", { settings: played }) : played;
  return item.resistance_level === null
    ? settings
    : t("programmes:played.atLevel", { settings, level: item.resistance_level, levels: RESISTANCE_LEVELS });
}

/** Describe a prescribed end-range time. */
export const describeEndRange = (prescribed: Schemas["EndRangePrescription"]): string =>
  t("programmes:endRange.words", {
    motion: shoulderMotionName(prescribed.motion),
    minutes: prescribed.minutes,
    band: prescribed.band_deg,
    torque: prescribed.torque_nm,
  });

/** Describe an item's settings and its prescribed end-range time. */
export const describePrescription = (item: PlayedSettings & Pick<ProgrammeItem, "end_range">): string =>
  item.end_range
    ? t("programmes:endRange.added", {
        settings: describeItem(item),
        endRange: describeEndRange(item.end_range),
      })
    : describeItem(item);

/** Return the playing time of all items together. An item that cannot be played has none. */
export const playingTimeS = (items: { duration_s: number | null }[]) =>
  totalDuration(items.map(({ duration_s }) => duration_s ?? 0));

/** Describe a version's settings. */
export function describeVersion(version: ProgrammeVersion): string {
  let words: string = t("programmes:played.total", {
    count: version.items.length,
    duration: formatDuration(playingTimeS(version.items)),
  });
  if (version.timer_minutes !== null)
    words = t("programmes:played.withTimer", { words, count: version.timer_minutes });
  if (version.sessions_per_week !== null)
    words = t("programmes:played.withWeeklyGoal", { words, count: version.sessions_per_week });
  return words;
}

/** Return the warning that the timer ends the programme early, or null if it does not. */
export function describeTimer(timerMinutes: number | null, durationS: number): string | null {
  if (timerMinutes === null || durationS <= 60 * timerMinutes) return null;
  return t("programmes:played.exceedsTimer", { duration: formatDuration(durationS), count: timerMinutes });
}

/** Return the differences from the plan or the previous version, such as "speed 80 % instead of 100 %". */
export function differences(
  before: ItemSettings,
  after: PlayedSettings,
  which: Setting[] = NAMES.filter((name) => before[name] !== after[name]),
): string[] {
  return which.map((name) =>
    t(`programmes:played.difference.${name}`, { after: value(name, after), before: value(name, before) }),
  );
}

function value(name: Setting, of: PlayedSettings): string {
  if (name === "method")
    return of.method === null ? t("programmes:played.unknown") : t(`programmes:methods.${of.method}`);
  if (name === "self_paced")
    return t(of.self_paced ? "programmes:played.pace.patient" : "programmes:played.pace.recording");
  const set = of[name];
  if (set === null) return t("programmes:played.unknown");
  if (name === "range_percent" || name === "speed_percent")
    return t("programmes:played.percent", { value: set });
  return name === "pause_s" ? t("programmes:played.seconds", { value: set }) : String(set);
}

/** Describe the changes between two versions. Items with the same recording are matched by order. */
export function changes(before: ProgrammeVersion, after: ProgrammeVersion): string[] {
  const [old, now] = [named(before.items), named(after.items)];
  const words: string[] = [];
  for (const [key, { label }] of old)
    if (!now.has(key)) words.push(t("programmes:changed.removed", { recording: label }));
  for (const [key, { label, item }] of now) {
    const was = old.get(key);
    if (!was)
      words.push(
        t("programmes:changed.added", { recording: label, played: lower(describePrescription(item)) }),
      );
    else {
      const differing = [...differences(was.item, item), ...endRangeChange(was.item, item)];
      if (differing.length > 0)
        words.push(
          t("programmes:changed.settings", {
            recording: label,
            differences: t("programmes:played.list", { words: differing }),
          }),
        );
    }
  }
  const [orderBefore, orderAfter] = [
    [...old.keys()].filter((key) => now.has(key)),
    [...now.keys()].filter((key) => old.has(key)),
  ];
  if (orderBefore.join() !== orderAfter.join()) words.push(t("programmes:changed.order"));
  words.push(...optional("timer", before.timer_minutes, after.timer_minutes));
  words.push(...optional("weeklyGoal", before.sessions_per_week, after.sessions_per_week));
  return words.length > 0 ? words : [t("programmes:changed.nothing")];
}

/** Describe the change of an item's prescribed end-range time; empty without a change. */
function endRangeChange(before: ProgrammeItem, after: ProgrammeItem): string[] {
  const [old, now] = [before, after].map(({ end_range }) => (end_range ? describeEndRange(end_range) : null));
  if (old === now) return [];
  if (!now) return [t("programmes:endRange.removed")];
  return [old ? t("programmes:endRange.changed", { after: now, before: old }) : now];
}

function named(items: ProgrammeItem[]): Map<string, { label: string; item: ProgrammeItem }> {
  const seen: Record<string, number> = {};
  return new Map(
    items.map((item) => {
      const time = (seen[item.recording_id] ?? 0) + 1;
      seen[item.recording_id] = time;
      const label =
        time === 1
          ? item.recording_name
          : t("programmes:changed.nth", { recording: item.recording_name, time });
      return [`${item.recording_id} ${time}`, { label, item }];
    }),
  );
}

function optional(what: "timer" | "weeklyGoal", before: number | null, after: number | null): string[] {
  if (before === after) return [];
  if (after === null) return [t(`programmes:changed.${what}.removed`, { count: before ?? 0 })];
  return [
    before === null
      ? t(`programmes:changed.${what}.set`, { count: after })
      : t(`programmes:changed.${what}.changed`, { count: after, before }),
  ];
}
