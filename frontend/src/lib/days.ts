/**
 * Days and times of the clinic. Every day, time of day and date field of the page is in the clinic's time zone, like
 * the reports, wherever the browser is. Without a zone, every day is that of UTC, and each time says so.
 */
const NO_ZONE = { name: "UTC", stated: true };
let zone = NO_ZONE;

/** Set the clinic's time zone, an IANA name; empty: none. A zone that the browser does not know counts as none. */
export function setClinicZone(name: string): void {
  zone = name && isZone(name) ? { name, stated: false } : NO_ZONE;
}

/** Return true if the page shows UTC because it has no time zone of the clinic. */
export const isZoneMissing = () => zone === NO_ZONE;

function isZone(name: string): boolean {
  try {
    new Intl.DateTimeFormat("en", { timeZone: name });
    return true;
  } catch {
    return false;
  }
}

/** Return a function that formats a time in the clinic's time zone. Without a zone, `stated` formats end with "UTC". */
export function clinicFormat(locale: string, options: Intl.DateTimeFormatOptions, { stated = false } = {}) {
  let madeFor = zone;
  let made: Intl.DateTimeFormat | null = null;
  return (moment: Date | number): string => {
    // The zone is known only after the sign-in.
    if (!made || madeFor !== zone) {
      const named = stated && zone.stated ? ({ timeZoneName: "short" } as const) : {};
      made = new Intl.DateTimeFormat(locale, { ...options, ...named, timeZone: zone.name });
    }
    madeFor = zone;
    return made.format(moment);
  };
}

const wallClock = clinicFormat("sv", {
  year: "numeric",
  month: "2-digit",
  day: "2-digit",
  hour: "2-digit",
  minute: "2-digit",
});
const MINUTE_MS = 60_000;
const DAY_MS = 86_400_000;

/** Return the clinic's wall clock time in the form of a datetime-local field, 2026-11-21T09:30. */
export const toLocalDateTime = (moment: Date | number) => wallClock(moment).replace(" ", "T");

/** Return the time at which the clinic's wall clock shows this time. */
export function fromLocalDateTime(text: string): Date {
  const asUtc = Date.parse(`${text}Z`);
  // Twice, because the offset may change between the two times.
  const near = asUtc - utcOffsetMinutes(asUtc) * MINUTE_MS;
  return new Date(asUtc - utcOffsetMinutes(near) * MINUTE_MS);
}

/** Return the minutes by which the clinic's time zone is ahead of UTC at a time. */
const utcOffsetMinutes = (at: number): number =>
  Number.isNaN(at)
    ? 0
    : (Date.parse(`${toLocalDateTime(at)}Z`) - Math.floor(at / MINUTE_MS) * MINUTE_MS) / MINUTE_MS;

/** Return the clinic's day of a time in the form 2026-11-21. */
export const dayOf = (moment: Date | number) => toLocalDateTime(moment).slice(0, 10);

/** Return today's date at the clinic. */
export const today = () => dayOf(Date.now());

/** Return the day that is `days` days later. */
export const addDays = (day: string, days: number) =>
  new Date(Date.parse(day) + days * DAY_MS).toISOString().slice(0, 10);

/** Return true for a date such as 2026-11-21, the form used in addresses and date fields. */
export const isDay = (value: unknown): value is string =>
  typeof value === "string" && /^\d{4}-\d{2}-\d{2}$/.test(value) && !Number.isNaN(Date.parse(value));

/** Return the start of a day at the clinic, or of the day that is `daysLater` days later. */
export const midnight = (day: string, daysLater: number) =>
  fromLocalDateTime(`${addDays(day, daysLater)}T00:00`).toISOString();
