import type { Schemas, SpanQuery } from "../../lib/api/client";
import { addDays, dayOf, isDay, midnight } from "../../lib/days";
import { formatDays } from "../../lib/format";

export const SUBJECTS = ["outcomes", "adherence", "usage", "stops", "tracking"] as const;
export type Subject = (typeof SUBJECTS)[number];
export const RANGES = ["days7", "weeks4", "months3", "year", "months12", "months24"] as const;
export const AMOUNTS = ["sessions", "hours", "repetitions"] as const;
export const MEASURES = ["spadi", "pain", "flexion", "abduction", "external_rotation"] as const;
export type Measure = Schemas["OutcomeChange"]["measure"];

/** Time, filters and choices of the figures in the form that the address contains. Days are the clinic's and inclusive. */
export interface FiguresSearch {
  from?: string;
  to?: string;
  range?: (typeof RANGES)[number];
  station?: string;
  by?: "day";
  of?: (typeof AMOUNTS)[number];
  measure?: Measure;
}

const oneOf = <Value extends string>(values: readonly Value[], given: unknown): Value | undefined =>
  values.find((value) => value === given);

/** Return the valid choices of an address. */
export function readSearch(given: Record<string, unknown>): FiguresSearch {
  const range = oneOf(RANGES, given.range);
  const of = oneOf(AMOUNTS, given.of);
  const measure = oneOf(MEASURES, given.measure);
  const station = given.station;
  return {
    ...(isDay(given.from) && { from: given.from }),
    ...(isDay(given.to) && { to: given.to }),
    ...(range && { range }),
    // A station's name may be a number.
    ...((typeof station === "string" || typeof station === "number") && { station: String(station) }),
    ...(given.by === "day" && { by: "day" }),
    ...(of && { of }),
    ...(measure && { measure }),
  };
}

/** Return the day that is `months` months earlier. The 31st may become a day of the next month. */
function monthsBefore(day: string, months: number): string {
  const from = new Date(day);
  from.setUTCMonth(from.getUTCMonth() - months);
  return from.toISOString().slice(0, 10);
}

/** Return the first and last day of the chosen time: the days that the user chose, else a range that ends today. */
export function daysOf(search: FiguresSearch, now: Date): { from: string; to: string } {
  const today = dayOf(now);
  const range = search.range ?? "months12";
  let from: string;
  if (range === "days7") from = addDays(today, -7 + 1);
  else if (range === "weeks4") from = addDays(today, -4 * 7 + 1);
  else if (range === "year") from = `${today.slice(0, 4)}-01-01`;
  else from = monthsBefore(today, { months3: 3, months12: 12, months24: 24 }[range]);
  return { from: search.from ?? from, to: search.to ?? today };
}

/** Return the time in the form that the service expects. */
export function spanOf(search: FiguresSearch, now: Date): SpanQuery {
  const { from, to } = daysOf(search, now);
  return {
    since: midnight(from, 0),
    until: midnight(to, 1),
    ...(search.station !== undefined && { station: search.station }),
  };
}

/** Return the first and last day of a period in words. */
export const describeSpan = (days: { from: string; to: string }) => formatDays(days.from, days.to);
