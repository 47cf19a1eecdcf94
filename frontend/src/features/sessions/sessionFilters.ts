import type { SessionQuery } from "../../lib/api/client";
import { isDay, midnight } from "../../lib/days";

const NAMES = ["from", "to", "therapist", "station", "stop", "note"] as const;
/** The only value of `note`: sessions that have ended and whose note is not signed. */
export const UNSIGNED = "unsigned";

/**
 * The filters of the session list in the form that the address contains. Days are local to this browser and
 * inclusive.
 */
export type Filters = { [name in (typeof NAMES)[number]]?: string };

/** Return the valid filters of an address. */
export function readFilters(search: Record<string, unknown>): Filters {
  const filters: Filters = {};
  for (const name of NAMES) {
    const given = search[name];
    if ((name === "from" || name === "to") && !isDay(given)) continue;
    if (name === "note" && given !== UNSIGNED) continue;
    // Numeric values are also valid, because a station's name may be a number.
    if (typeof given === "string" || typeof given === "number") filters[name] = String(given);
  }
  return filters;
}

/** Return the filters in the form that the service expects. A day starts and ends at the clinic's midnight. */
export function toQuery({ from, to, note, ...same }: Filters): SessionQuery {
  return {
    ...same,
    ...(note && { unsigned: true }),
    ...(from && { since: midnight(from, 0) }),
    ...(to && { until: midnight(to, 1) }),
  };
}
