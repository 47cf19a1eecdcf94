import type { Schemas } from "../../lib/api/client";
import { ACTIONS } from "./auditActions";
import { KINDS, REASONS } from "./auditKinds";
import { AUDIT } from "./messages";

type Entry = Schemas["AuditEntry"];

/** What was done, in words; a code that an older or newer service has written stands as it is. */
export function actionOf(code: string): string {
  return Object.hasOwn(ACTIONS, code) ? ACTIONS[code as keyof typeof ACTIONS] : code;
}

/** All actions to choose from, in the order of their words; and `chosen`, whatever it is. */
export function actionChoices(chosen: string | undefined): { value: string; label: string }[] {
  const codes = new Set([...Object.keys(ACTIONS), ...(chosen ? [chosen] : [])]);
  return [...codes]
    .map((value) => ({ value, label: actionOf(value) }))
    .sort((one, other) => one.label.localeCompare(other.label));
}

/** What it was done to: kinds of things, without their ids; a text that names none of them as it is. */
export function subjectOf(subject: string): string {
  const words = subject.split(" ");
  const kinds = words.filter((_, n) => n % 2 === 0);
  const known = words.length % 2 === 0 && kinds.every((kind) => Object.hasOwn(KINDS, kind));
  return known ? AUDIT.several(kinds.map(kindOf)) : subject;
}

/** Why it was refused and which kinds of rows changed, a line each. What else is told stands among the details as they are. */
export function linesOf({ detail }: Entry): string[] {
  const of = (what: string) => kindsIn(detail[what]);
  return [
    ...("why" in detail ? [AUDIT.why(reasonOf(String(detail.why)))] : []),
    ...("again" in detail ? [AUDIT.again(Number(detail.again))] : []),
    ...of("added").map(AUDIT.added),
    ...[...of("changed"), ...of("changed_many")].map(AUDIT.changed),
    ...of("removed").map(AUDIT.removed),
  ];
}

function reasonOf(code: string): string {
  return Object.hasOwn(REASONS, code) ? (REASONS[code] as string) : code;
}

function kindsIn(told: unknown): string[] {
  const tables = Array.isArray(told)
    ? told.map(String)
    : told && typeof told === "object"
      ? Object.keys(told)
      : [];
  return tables.length > 0 ? [AUDIT.several(tables.map(kindOf))] : [];
}

function kindOf(code: string): string {
  return Object.hasOwn(KINDS, code) ? (KINDS[code] as string) : code;
}
