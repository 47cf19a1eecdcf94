import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ACTIONS } from "./auditActions";

type Entry = Schemas["AuditEntry"];

const KINDS: Partial<Record<string, string>> = t("administration:kinds", { returnObjects: true });
const REASONS: Partial<Record<string, string>> = t("administration:reasons", { returnObjects: true });
const IDENTIFIERS: Partial<Record<string, string>> = t("sessions:identifiers", { returnObjects: true });
const wordOf = (words: object, code: string): string =>
  Object.hasOwn(words, code) ? words[code as keyof typeof words] : code;

/** Return the text of an action. An unknown code from another version is returned unchanged. */
export const describeAction = (code: string) => wordOf(ACTIONS, code);

/** Return all actions sorted by text, including `chosen` even if it is unknown. */
export function actionChoices(chosen: string | undefined): { value: string; label: string }[] {
  const codes = new Set([...Object.keys(ACTIONS), ...(chosen ? [chosen] : [])]);
  return [...codes]
    .map((value) => ({ value, label: describeAction(value) }))
    .sort((a, b) => a.label.localeCompare(b.label));
}

/**
 * Return the kinds of the changed objects without their ids, which can contain spaces ("Station 1 2" is version 2
 * of Station 1). A subject that does not begin with a known kind is returned unchanged.
 */
export function describeSubject(subject: string): string {
  const [first = "", ...others] = subject.split(" ");
  const isKind = (word: string) => Object.hasOwn(KINDS, word);
  if (!isKind(first) || others.length === 0) return subject;
  return t("common:format.list", { words: [first, ...others.filter(isKind)].map(describeKind) });
}

/**
 * Return one line for the refusal reason and one for each kind of change. The raw entry shows the other
 * details.
 */
export function describeDetail({ detail }: Entry): string[] {
  const kindsOf = (what: string) => kindsIn(detail[what]);
  return [
    ...("why" in detail
      ? [t("administration:audit.reason", { reason: describeReason(String(detail.why)) })]
      : []),
    ...("identity" in detail
      ? [t("administration:audit.identity", { identifiers: describeIdentifiers(String(detail.identity)) })]
      : []),
    ...("access_token" in detail ? [t("administration:audit.byToken")] : []),
    ...("again" in detail ? [t("administration:audit.repeated", { times: Number(detail.again) })] : []),
    ...kindsOf("added").map((kinds) => t("administration:audit.added", { kinds })),
    ...[...kindsOf("changed"), ...kindsOf("changed_many")].map((kinds) =>
      t("administration:audit.changed", { kinds }),
    ),
    ...kindsOf("removed").map((kinds) => t("administration:audit.removed", { kinds })),
  ];
}

const describeIdentifiers = (codes: string) =>
  t("common:format.list", { words: codes.split("+").map((code) => wordOf(IDENTIFIERS, code)) });

const describeReason = (code: string) => wordOf(REASONS, code);

function kindsIn(rows: unknown): string[] {
  const tables = Array.isArray(rows)
    ? rows.map(String)
    : rows && typeof rows === "object"
      ? Object.keys(rows)
      : [];
  return tables.length > 0 ? [t("common:format.list", { words: tables.map(describeKind) })] : [];
}

const describeKind = (code: string) => wordOf(KINDS, code);
