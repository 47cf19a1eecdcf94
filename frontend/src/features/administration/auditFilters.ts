import type { AuditQuery, Schemas } from "../../lib/api/client";
import { isDay, midnight } from "../../lib/days";

const FILTER_NAMES = ["from", "to", "account_id", "patient_id", "action", "outcome"] as const;
const OUTCOMES: Record<Schemas["AuditEntry"]["outcome"], true> = { done: true, refused: true, failed: true };

/**
 * The filters of the audit trail in the form that the address contains. Days are local to this browser and
 * inclusive.
 */
export type AuditFilters = {
  [name in Exclude<(typeof FILTER_NAMES)[number], "outcome">]?: string;
} & { outcome?: Schemas["AuditEntry"]["outcome"] };

/** Return the valid filters of an address. */
export function readAuditFilters(search: Record<string, unknown>): AuditFilters {
  const isValid = (name: string, value: unknown) =>
    name === "from" || name === "to"
      ? isDay(value)
      : name === "outcome"
        ? Object.hasOwn(OUTCOMES, String(value))
        : typeof value === "string" && value !== "";
  return Object.fromEntries(
    FILTER_NAMES.filter((name) => isValid(name, search[name])).map((name) => [name, search[name]]),
  ) as AuditFilters;
}

/** Return the filters in the form that the service expects. A day starts and ends at the clinic's midnight. */
export function toAuditQuery({ from, to, ...rest }: AuditFilters): AuditQuery {
  return { ...rest, ...(from && { since: midnight(from, 0) }), ...(to && { until: midnight(to, 1) }) };
}
