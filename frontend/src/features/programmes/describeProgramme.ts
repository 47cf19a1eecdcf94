import type { ProgrammeItem, ProgrammeVersion, Schemas } from "../../lib/api/client";
import { formatSpan } from "../../lib/format";
import { settingsWords } from "../station/playSettingsModel";
import { CHANGED, METHODS, PLAYED, SETTINGS, type Setting } from "./messages";

/** The playback settings of a programme item. */
export type ItemSettings = Pick<ProgrammeItem, Setting>;
/** The settings of a run; an old run may lack some. */
type PlayedSettings = Omit<ItemSettings, "load_level" | "method"> &
  Pick<Schemas["PlannedRun"], "load_level" | "method">;

const NAMES = Object.keys(SETTINGS) as Setting[];

/** Describe an item's settings. */
export function itemWords(item: PlayedSettings): string {
  const settings = settingsWords(item) ?? PLAYED.asTaught;
  return item.load_level === null ? settings : PLAYED.atLevel(settings, item.load_level);
}

/** Describe a version's settings. */
export function versionWords(version: ProgrammeVersion): string {
  let words = PLAYED.whole(version.items.length, formatSpan(version.duration_s));
  if (version.timer_minutes !== null) words = PLAYED.withTimer(words, version.timer_minutes);
  if (version.sessions_per_week !== null) words = PLAYED.withWish(words, version.sessions_per_week);
  return words;
}

/** Describe that the timer ends the programme early; null if it does not. */
export function timerWords(timerMinutes: number | null, durationS: number): string | null {
  if (timerMinutes === null || durationS <= 60 * timerMinutes) return null;
  return PLAYED.beyond(formatSpan(durationS), timerMinutes);
}

/** Describe differences from the plan or the previous version: "speed 80 % instead of 100 %". */
export function differences(
  before: ItemSettings,
  after: PlayedSettings,
  which: Setting[] = NAMES.filter((name) => before[name] !== after[name]),
): string[] {
  return which.map((name) => PLAYED.instead(name, value(name, after), value(name, before)));
}

function value(name: Setting, of: PlayedSettings): string {
  if (name === "method") return of.method === null ? PLAYED.unknown : METHODS[of.method];
  const set = of[name];
  if (set === null) return PLAYED.unknown;
  if (name === "range_percent" || name === "speed_percent") return PLAYED.percent(set);
  return name === "pause_s" ? PLAYED.seconds(set) : String(set);
}

/** Describe the changes between two versions. Items with the same recording are matched by order. */
export function changes(before: ProgrammeVersion, after: ProgrammeVersion): string[] {
  const [old, now] = [named(before.items), named(after.items)];
  const words: string[] = [];
  for (const [key, { label }] of old) if (!now.has(key)) words.push(CHANGED.leftOut(label));
  for (const [key, { label, item }] of now) {
    const was = old.get(key);
    if (!was) words.push(CHANGED.added(label, itemWords(item)));
    else if (differences(was.item, item).length > 0)
      words.push(CHANGED.set(label, PLAYED.several(differences(was.item, item))));
  }
  const [kept, stays] = [
    [...old.keys()].filter((key) => now.has(key)),
    [...now.keys()].filter((key) => old.has(key)),
  ];
  if (kept.join() !== stays.join()) words.push(CHANGED.order);
  words.push(...optional(CHANGED.timer, before.timer_minutes, after.timer_minutes));
  words.push(...optional(CHANGED.wish, before.sessions_per_week, after.sessions_per_week));
  return words.length > 0 ? words : [CHANGED.nothing];
}

function named(items: ProgrammeItem[]): Map<string, { label: string; item: ProgrammeItem }> {
  const seen: Record<string, number> = {};
  return new Map(
    items.map((item) => {
      const time = (seen[item.recording_id] ?? 0) + 1;
      seen[item.recording_id] = time;
      const label = time === 1 ? item.recording_name : CHANGED.again(item.recording_name, time);
      return [`${item.recording_id} ${time}`, { label, item }];
    }),
  );
}

function optional(words: typeof CHANGED.timer, before: number | null, after: number | null): string[] {
  if (before === after) return [];
  if (after === null) return [words.gone(before ?? 0)];
  return [before === null ? words.begun(after) : words.moved(after, before)];
}
