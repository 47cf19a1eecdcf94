import type { SessionQuery } from "../../lib/api/client";
import { isDay, midnight } from "../../lib/days";

const NAMES = ["from", "to", "therapist", "station", "stop"] as const;

/**
 * The filters of the session list, as the address holds them. Days are local to this browser and inclusive.
 */
export type Filters = { [name in (typeof NAMES)[number]]?: string };

/** Return the valid filters of an address. */
export function readFilters(search: Record<string, unknown>): Filters {
  const filters: Filters = {};
  for (const name of NAMES) {
    const given = search[name];
    if ((name === "from" || name === "to") && !isDay(given)) continue;
    // Numeric values are valid too: a station's name may be a number.
    if (typeof given === "string" || typeof given === "number") filters[name] = String(given);
  }
  return filters;
}

/** The filters as the service expects them: a day starts and ends at this browser's midnight. */
export function toQuery({ from, to, ...same }: Filters): SessionQuery {
  return { ...same, ...(from && { since: midnight(from, 0) }), ...(to && { until: midnight(to, 1) }) };
}
