import { clinicFormat, dayOf } from "./days";
import { t } from "./i18n";
import { joinUnits } from "./joinUnits";
import { LANGUAGE, LOCALE } from "./language";

const DAY = { year: "numeric", month: "short", day: "numeric" } as const;
const calendarDay = new Intl.DateTimeFormat(LOCALE, { ...DAY, timeZone: "UTC" });
const calendarDayOfYear = new Intl.DateTimeFormat(LOCALE, {
  month: "short",
  day: "numeric",
  timeZone: "UTC",
});
const day = clinicFormat(LOCALE, DAY);
const dayOfYear = clinicFormat(LOCALE, { month: "short", day: "numeric" });
const month = clinicFormat(LOCALE, { year: "2-digit", month: "numeric" });
const STATED = { stated: true };
const time = clinicFormat(LOCALE, { hour: "2-digit", minute: "2-digit" }, STATED);
const clock = clinicFormat(LOCALE, { hour: "2-digit", minute: "2-digit", second: "2-digit" }, STATED);

/** Return a calendar day such as 1968-04-12 in words. It does not depend on the time zone. */
export const formatDay = (iso: string) => joinUnits(calendarDay.format(Date.parse(iso)));
/** Return the clinic's day of a time. */
export const formatDayOf = (moment: string) => joinUnits(day(new Date(moment)));
/** Return a period from one calendar day to another. Within one year it has the year once, and fits a line of a tile. */
export function formatDays(first: string, last: string): string {
  if (first === last) return formatDay(first);
  if (first.slice(0, 4) !== last.slice(0, 4)) {
    return t("common:format.range", { from: formatDay(first), to: formatDay(last) });
  }
  const [from, to] = LANGUAGE === "ja" ? [calendarDay, calendarDayOfYear] : [calendarDayOfYear, calendarDay];
  const period = t("common:format.range", {
    from: from.format(Date.parse(first)),
    to: to.format(Date.parse(last)),
  });
  return period.replaceAll(" ", "\u00a0").replace("〜", "\u2060〜\u2060");
}
/** Return two days of the clinic in short: without the year if it is the same, else without the day. */
export function formatShortDays(moments: string[]): string[] {
  const dates = moments.map((moment) => new Date(moment));
  const years = new Set(dates.map((date) => dayOf(date).slice(0, 4)));
  return dates.map(years.size > 1 ? month : dayOfYear).map(joinUnits);
}
export const formatMoment = (iso: string) => {
  const moment = new Date(iso);
  return t("common:format.moment", { day: day(moment), time: time(moment) });
};
/** Return a time that follows another one. If both are on the same day, return only the time of day. */
export const formatAfter = (iso: string, since: string) =>
  formatDayOf(iso) === formatDayOf(since) ? time(new Date(iso)) : formatMoment(iso);
export const formatClock = (moment: number | Date) => clock(moment);

const secondsAsShown = (duration_s: number) => Math.max(0, Math.ceil(duration_s));

/** Return the sum of durations as they are shown, so that a reader who adds them up finds the same. */
export const totalDuration = (durations_s: number[]) =>
  durations_s.reduce((total_s, duration_s) => total_s + secondsAsShown(duration_s), 0);

/** Return a counted time in whole seconds. A started second does not count yet. */
export const countedSeconds = (time_s: number) => Math.floor(time_s);

/**
 * Return 75.2 as 1 min 16 s. Its units distinguish it from a time of day and from hours. It is rounded up, so that
 * 0 s means finished.
 */
export function formatDuration(duration_s: number): string {
  const wholeSeconds = secondsAsShown(duration_s);
  const minutes = Math.floor(wholeSeconds / 60);
  const seconds = wholeSeconds % 60;
  if (minutes === 0) return t("common:format.seconds", { seconds });
  if (seconds === 0) return t("common:format.minutes", { minutes });
  return t("common:format.minutesAndSeconds", { minutes, seconds });
}

/** Return a range of angles, or a dash if it is unknown. */
export function formatRange(min: number | null, max: number | null): string {
  return min === null || max === null
    ? "–"
    : t("common:format.range", { from: formatDeg(min), to: formatDeg(max) });
}

/** Return degrees with a typographic minus sign, or a dash if unknown. */
export function formatDeg(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? (0).toFixed(digits) : text).replace("-", "−");
}

/** Return an entered number or a score: one decimal, or none if it is whole. */
export const formatMeasured = (value: number | null | undefined) =>
  formatDeg(value, Number.isInteger(roundToTenths(value ?? 0)) ? 0 : 1);

/** Return the change of an entered number or a score with its sign. */
export const formatChange = (change: number) =>
  `${roundToTenths(change) > 0 ? "+" : ""}${formatMeasured(change)}`;

/** Decimals of a tracking error on every page, as in the reports. */
export const ERROR_DIGITS = 2;
/** Return a tracking error in degrees. */
export const formatError = (error: number | null | undefined) => formatDeg(error, ERROR_DIGITS);

const roundTo = (value: number, digits: number) => Number(value.toFixed(digits));

/** Return a number as it is shown. Limits are compared with this number. */
export const roundToTenths = (value: number) => roundTo(value, 1);

/**
 * Return the change from one number to another: the difference of the numbers as they are shown, so that a reader who
 * subtracts them finds the same. The service's rule is the same (backend/kata/clinic/rounding.py).
 */
export const changeAsShown = (before: number, now: number, digits = 1) =>
  roundTo(roundTo(now, digits) - roundTo(before, digits), digits);

/** Return the sum of numbers as they are shown, with the decimals of these numbers. */
export const totalAsShown = (values: number[], digits: number) =>
  values.reduce((total, value) => roundTo(total + roundTo(value, digits), digits), 0);

/** Return degrees with the unit. */
export const formatDegrees = (value: number | null, digits = 1): string => `${formatDeg(value, digits)}°`;

/** Return the name of the side, or a dash if unknown. */
export const formatSide = (side: "left" | "right" | null) =>
  side === null ? "–" : t(`common:sides.${side}`);

/** Return "one, other" with the separators of the language. */
export const formatList = (words: string[]) => t("common:format.list", { words });
