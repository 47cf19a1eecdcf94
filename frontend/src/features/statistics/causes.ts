import type { Schemas } from "../../lib/api/client";

type Row = Schemas["StopCount"];

/** Return the number of stopped sessions, or of alarms, of a cause at all stations. */
export const countOf = (rows: Row[], code: string, counted: "sessions" | "alarms") =>
  rows.reduce((sum, row) => sum + (row.code === code ? row[counted] : 0), 0);

/** Return the causes, the one with the most stopped sessions at all stations first. */
export const causesOf = (rows: Row[]) =>
  [...new Set(rows.map((row) => row.code))].sort(
    (one, other) => countOf(rows, other, "sessions") - countOf(rows, one, "sessions"),
  );

/** Return the cause that stopped the most sessions; undefined if no session was stopped. */
export function mostFrequentCause(rows: Row[]): string | undefined {
  const [first] = causesOf(rows);
  return first !== undefined && countOf(rows, first, "sessions") > 0 ? first : undefined;
}
