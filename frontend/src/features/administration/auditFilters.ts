import type { AuditWanted } from "../../lib/api/client";
import { isDay, midnight } from "../../lib/days";
import { OUTCOMES } from "./messages";

const NAMES = ["from", "to", "account_id", "patient_id", "action", "outcome"] as const;

/** What the audit trail is narrowed to, as it stands in the address. Days are this browser's, both included. */
export type AuditFilters = {
  [name in Exclude<(typeof NAMES)[number], "outcome">]?: string;
} & { outcome?: keyof typeof OUTCOMES };

/** Of an address, what the list knows. */
export function readAuditFilters(search: Record<string, unknown>): AuditFilters {
  const fits = (name: string, given: unknown) =>
    name === "from" || name === "to"
      ? isDay(given)
      : name === "outcome"
        ? Object.hasOwn(OUTCOMES, String(given))
        : typeof given === "string" && given !== "";
  return Object.fromEntries(
    NAMES.filter((name) => fits(name, search[name])).map((name) => [name, search[name]]),
  ) as AuditFilters;
}

/** As the service is asked: a day begins and ends at this browser's midnight. */
export function asAsked({ from, to, ...same }: AuditFilters): AuditWanted {
  return { ...same, ...(from && { since: midnight(from, 0) }), ...(to && { until: midnight(to, 1) }) };
}
