import type { SessionQuery } from "../../lib/api/client";
import { isDay, midnight } from "../../lib/days";

const NAMES = ["from", "to", "therapist", "station", "stop"] as const;

/** What the list of sessions is narrowed to, as it stands in the address. Days are this browser's, both included. */
export type Filters = { [name in (typeof NAMES)[number]]?: string };

/** Of an address, what the list knows. */
export function readFilters(search: Record<string, unknown>): Filters {
  const filters: Filters = {};
  for (const name of NAMES) {
    const given = search[name];
    if ((name === "from" || name === "to") && !isDay(given)) continue;
    // The address has numbers as numbers, and a station may be called one.
    if (typeof given === "string" || typeof given === "number") filters[name] = String(given);
  }
  return filters;
}

/** As the service is asked: a day begins and ends at this browser's midnight. */
export function asWanted({ from, to, ...same }: Filters): SessionQuery {
  return { ...same, ...(from && { since: midnight(from, 0) }), ...(to && { until: midnight(to, 1) }) };
}
