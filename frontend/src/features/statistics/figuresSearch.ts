import type { Schemas, SpanQuery } from "../../lib/api/client";
import { utcOffsetMinutes } from "../../lib/api/clinicApi";
import { isDay, midnight } from "../../lib/days";

export const SUBJECTS = ["outcomes", "usage", "stops", "tracking"] as const;
export type Subject = (typeof SUBJECTS)[number];
export const RANGES = ["weeks4", "months3", "year", "months12", "months24"] as const;
export const AMOUNTS = ["sessions", "hours", "repetitions"] as const;
export const MEASURES = ["spadi", "pain", "flexion", "abduction", "external_rotation"] as const;
export type Measure = Schemas["OutcomeChange"]["measure"];

/** Time, filters and choices of the figures in the form that the address contains. Days are local and inclusive. */
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

/** Return a local day in the form 2026-11-21. */
export const isoDay = (moment: Date) =>
  `${moment.getFullYear()}-${String(moment.getMonth() + 1).padStart(2, "0")}-${String(moment.getDate()).padStart(2, "0")}`;

/** Return the first and last day of the chosen time: the days that the user chose, else a range that ends today. */
export function daysOf(search: FiguresSearch, today: Date): { from: string; to: string } {
  const from = new Date(today);
  const range = search.range ?? "months12";
  if (range === "weeks4") from.setDate(from.getDate() - 4 * 7 + 1);
  else if (range === "year") from.setMonth(0, 1);
  else from.setMonth(from.getMonth() - { months3: 3, months12: 12, months24: 24 }[range]);
  return { from: search.from ?? isoDay(from), to: search.to ?? isoDay(today) };
}

/** Return the span of `days` days that ends today. */
export function lastDays(days: number, today: Date): SpanQuery {
  const from = new Date(today);
  from.setDate(from.getDate() - days + 1);
  return spanOf({ from: isoDay(from) }, today);
}

/** Return the time in the form that the service expects. */
export function spanOf(search: FiguresSearch, today: Date): SpanQuery {
  const { from, to } = daysOf(search, today);
  return {
    since: midnight(from, 0),
    until: midnight(to, 1),
    utc_offset_minutes: utcOffsetMinutes(),
    ...(search.station !== undefined && { station: search.station }),
  };
}
