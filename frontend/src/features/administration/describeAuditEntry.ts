import type { Schemas } from "../../lib/api/client";
import { ACTIONS } from "./auditActions";
import { KINDS, REASONS } from "./auditKinds";
import { AUDIT } from "./messages";

type Entry = Schemas["AuditEntry"];

/** Return the text of an action. An unknown code from another version is returned unchanged. */
export function describeAction(code: string): string {
  return Object.hasOwn(ACTIONS, code) ? ACTIONS[code as keyof typeof ACTIONS] : code;
}

/** Return all actions sorted by text, and `chosen` even if it is unknown. */
export function actionChoices(chosen: string | undefined): { value: string; label: string }[] {
  const codes = new Set([...Object.keys(ACTIONS), ...(chosen ? [chosen] : [])]);
  return [...codes]
    .map((value) => ({ value, label: describeAction(value) }))
    .sort((a, b) => a.label.localeCompare(b.label));
}

/**
 * Return the kinds of the changed things without their ids. A subject with an unknown kind is returned
 * unchanged.
 */
export function describeSubject(subject: string): string {
  const words = subject.split(" ");
  const kinds = words.filter((_, n) => n % 2 === 0);
  const known = words.length % 2 === 0 && kinds.every((kind) => Object.hasOwn(KINDS, kind));
  return known ? AUDIT.several(kinds.map(describeKind)) : subject;
}

/**
 * Return one line for the refusal reason and one for each changed kind. The raw entry shows the other
 * details.
 */
export function describeDetail({ detail }: Entry): string[] {
  const kindsOf = (what: string) => kindsIn(detail[what]);
  return [
    ...("why" in detail ? [AUDIT.why(describeReason(String(detail.why)))] : []),
    ...("again" in detail ? [AUDIT.again(Number(detail.again))] : []),
    ...kindsOf("added").map(AUDIT.added),
    ...[...kindsOf("changed"), ...kindsOf("changed_many")].map(AUDIT.changed),
    ...kindsOf("removed").map(AUDIT.removed),
  ];
}

function describeReason(code: string): string {
  return Object.hasOwn(REASONS, code) ? (REASONS[code] as string) : code;
}

function kindsIn(rows: unknown): string[] {
  const tables = Array.isArray(rows)
    ? rows.map(String)
    : rows && typeof rows === "object"
      ? Object.keys(rows)
      : [];
  return tables.length > 0 ? [AUDIT.several(tables.map(describeKind))] : [];
}

function describeKind(code: string): string {
  return Object.hasOwn(KINDS, code) ? (KINDS[code] as string) : code;
}
