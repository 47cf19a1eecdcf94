import type { ProgrammeItem, ProgrammeVersion, Schemas } from "../api/client";
import { formatSpan } from "../shared/format";
import { LOAD_LEVELS } from "../shared/levels";
import { settingsWords } from "../shared/settings";

/** How one recording of a programme is played. */
export type ItemSettings = Pick<ProgrammeItem, Schemas["PlannedRun"]["changed"][number]>;
type Setting = keyof ItemSettings;
/** As a run has them: an old one may lack some. */
type PlayedSettings = Omit<ItemSettings, "load_level" | "method"> &
  Pick<Schemas["PlannedRun"], "load_level" | "method">;

const METHODS: Record<ItemSettings["method"], string> = {
  smooth: "smooth",
  learned: "learned",
  paper: "as in the paper",
};
const NAMES: Record<Setting, string> = {
  range_percent: "range",
  speed_percent: "speed",
  repetitions: "repetitions",
  pause_s: "pause",
  load_level: "resistance level",
  method: "way of playing",
};
const UNITS: Partial<Record<Setting, string>> = { range_percent: " %", speed_percent: " %", pause_s: " s" };
const SETTINGS = Object.keys(NAMES) as Setting[];

/** How one recording is played, in words. */
export function itemWords(item: PlayedSettings): string {
  const settings = settingsWords(item) ?? "As it was taught, once";
  return item.load_level === null
    ? settings
    : `${settings}; resistance level ${item.load_level} of ${LOAD_LEVELS}`;
}

/** What a version asks for as a whole, in words. */
export function versionWords(version: ProgrammeVersion): string {
  const words = [count(version.items.length, "recording"), `${formatSpan(version.duration_s)} of playing`];
  if (version.timer_minutes !== null) words.push(`timer ${count(version.timer_minutes, "minute")}`);
  if (version.sessions_per_week !== null) words.push(`${count(version.sessions_per_week, "session")} a week`);
  return words.join(", ");
}

/** Whether the timer ends a programme before it is through; null where it does not, or there is none. */
export function timerWords(timerMinutes: number | null, durationS: number): string | null {
  if (timerMinutes === null || durationS <= 60 * timerMinutes) return null;
  return `This takes ${formatSpan(durationS)}, and after ${count(timerMinutes, "minute")} of playing no further recording is begun: the last ones may be left out.`;
}

/** What was played otherwise than planned, or is prescribed otherwise than before: "speed 80 % instead of 100 %". */
export function differences(
  before: ItemSettings,
  after: PlayedSettings,
  which: Setting[] = SETTINGS.filter((name) => before[name] !== after[name]),
): string[] {
  return which.map((name) => `${NAMES[name]} ${value(name, after)} instead of ${value(name, before)}`);
}

function value(name: Setting, of: PlayedSettings): string {
  if (name === "method") return of.method === null ? "not known" : METHODS[of.method];
  return of[name] === null ? "not known" : `${of[name]}${UNITS[name] ?? ""}`;
}

/** From one version to the next, in words; the same recording twice is told apart by its order. */
export function changes(before: ProgrammeVersion, after: ProgrammeVersion): string[] {
  const [old, now] = [named(before.items), named(after.items)];
  const words: string[] = [];
  for (const [key, { label }] of old) if (!now.has(key)) words.push(`${label} is left out`);
  for (const [key, { label, item }] of now) {
    const was = old.get(key);
    if (!was) words.push(`${label} is new: ${lower(itemWords(item))}`);
    else if (differences(was.item, item).length > 0)
      words.push(`${label}: ${differences(was.item, item).join(", ")}`);
  }
  const [kept, stays] = [
    [...old.keys()].filter((key) => now.has(key)),
    [...now.keys()].filter((key) => old.has(key)),
  ];
  if (kept.join() !== stays.join()) words.push("The order is another one");
  words.push(...optional("The timer", "minute", before.timer_minutes, after.timer_minutes));
  words.push(...optional("The wish", "session a week", before.sessions_per_week, after.sessions_per_week));
  return words.length > 0 ? words : ["Nothing of what is played"];
}

function named(items: ProgrammeItem[]): Map<string, { label: string; item: ProgrammeItem }> {
  const seen: Record<string, number> = {};
  return new Map(
    items.map((item) => {
      const time = (seen[item.recording_id] ?? 0) + 1;
      seen[item.recording_id] = time;
      const label = time === 1 ? item.recording_name : `${item.recording_name} (${time})`;
      return [`${item.recording_id} ${time}`, { label, item }];
    }),
  );
}

function optional(what: string, unit: string, before: number | null, after: number | null): string[] {
  if (before === after) return [];
  if (after === null) return [`${what} of ${count(before ?? 0, unit)} is gone`];
  return [`${what} is ${count(after, unit)}${before === null ? "" : ` instead of ${before}`}`];
}

/** "1 session", "2 sessions", "2 sessions a week". */
export function count(number: number, what: string): string {
  const [noun = "", ...rest] = what.split(" ");
  return [number, number === 1 ? noun : `${noun}s`, ...rest].join(" ");
}

/** To go on in a sentence with. */
export const lower = (text: string) => text.charAt(0).toLowerCase() + text.slice(1);
