import { LOCALE } from "./language";
import { FORMAT, SIDES } from "./messages";

const day = new Intl.DateTimeFormat(LOCALE, { year: "numeric", month: "short", day: "numeric" });
const time = new Intl.DateTimeFormat(LOCALE, { hour: "2-digit", minute: "2-digit" });
const clock = new Intl.DateTimeFormat(LOCALE, { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** A day of the calendar, 1968-04-12: the same wherever one is. */
export const formatDay = (iso: string) => day.format(new Date(`${iso}T00:00`));
/** The day on which a moment was, here. */
export const formatDayOf = (moment: string) => day.format(new Date(moment));
export const formatMoment = (iso: string) => {
  const moment = new Date(iso);
  return FORMAT.moment(day.format(moment), time.format(moment));
};
/** A moment behind another: its time alone, where it was the same day. */
export const formatAfter = (iso: string, since: string) =>
  formatDayOf(iso) === formatDayOf(since) ? time.format(new Date(iso)) : formatMoment(iso);
export const formatClock = (moment: number | Date) => clock.format(moment);

/** 75.2 as 1:16: what is left is rounded up, so that 0:00 means over. */
export function formatSpan(seconds: number): string {
  const whole = Math.max(0, Math.ceil(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/** From the lowest to the highest angle; a dash where they are not known. */
export function formatRange(min: number | null, max: number | null): string {
  return min === null || max === null ? "–" : FORMAT.range(formatDeg(min), formatDeg(max));
}

/** Degrees with one digit and a true minus sign; a dash where there is none. */
export function formatDeg(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? (0).toFixed(digits) : text).replace("-", "−");
}

/** The same with its unit. */
export const formatDegrees = (value: number | null, digits = 1): string => `${formatDeg(value, digits)}°`;

/** Which shoulder; a dash where nobody has said. */
export const sideWord = (side: "left" | "right" | null) => (side === null ? "–" : SIDES[side]);
