import { t } from "./i18n";
import { LOCALE } from "./language";

const day = new Intl.DateTimeFormat(LOCALE, { year: "numeric", month: "short", day: "numeric" });
const time = new Intl.DateTimeFormat(LOCALE, { hour: "2-digit", minute: "2-digit" });
const clock = new Intl.DateTimeFormat(LOCALE, { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** A calendar day such as 1968-04-12, independent of the time zone. */
export const formatDay = (iso: string) => day.format(new Date(`${iso}T00:00`));
/** The local day of a moment. */
export const formatDayOf = (moment: string) => day.format(new Date(moment));
export const formatMoment = (iso: string) => {
  const moment = new Date(iso);
  return t("common:format.moment", { day: day.format(moment), time: time.format(moment) });
};
/** A moment after another one: only the time if both are on the same day. */
export const formatAfter = (iso: string, since: string) =>
  formatDayOf(iso) === formatDayOf(since) ? time.format(new Date(iso)) : formatMoment(iso);
export const formatClock = (moment: number | Date) => clock.format(moment);

/** 75.2 as 1:16. Rounded up, so that 0:00 means finished. */
export function formatSpan(seconds: number): string {
  const wholeSeconds = Math.max(0, Math.ceil(seconds));
  return `${Math.floor(wholeSeconds / 60)}:${String(wholeSeconds % 60).padStart(2, "0")}`;
}

/** A range of angles, or a dash if it is unknown. */
export function formatRange(min: number | null, max: number | null): string {
  return min === null || max === null
    ? "–"
    : t("common:format.range", { from: formatDeg(min), to: formatDeg(max) });
}

/** Degrees with a real minus sign, or a dash if unknown. */
export function formatDeg(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? (0).toFixed(digits) : text).replace("-", "−");
}

/** Degrees with the unit. */
export const formatDegrees = (value: number | null, digits = 1): string => `${formatDeg(value, digits)}°`;

/** The name of the side, or a dash if unknown. */
export const sideWord = (side: "left" | "right" | null) => (side === null ? "–" : t(`common:sides.${side}`));

/** Return "one, other", as the language lists things. */
export const formatList = (words: string[]) => t("common:format.list", { words });
