import type english from "../../server-messages.json";
import type { components } from "./api/schema";
import { joinUnits } from "./joinUnits";
import { LANGUAGE, type Language } from "./language";

type Schemas = components["schemas"];
type Key = Schemas["TextKey"] | Schemas["NestedText"];
type Nested = Schemas["NestedText"];

/** The code of a message of the service. */
type ServerCode = keyof typeof english;
type Catalogue = Readonly<Record<ServerCode, string>>;

/** The translations; null while the page shows the service's English texts. */
let catalogue: Partial<Catalogue> | null = null;

/**
 * Fetch the translations of the service's messages before the page is drawn. Without them the page shows the
 * service's own English texts.
 */
export async function loadServerTexts(language: Language = LANGUAGE): Promise<void> {
  catalogue = null;
  if (language === "en") return;
  try {
    // If a translation is missing, this does not compile.
    catalogue = (await import("../locales/ja/server.json")).default satisfies Catalogue;
  } catch {
    // A newer page has replaced this file on the server.
  }
}

/** Translate a text of the service by its code. A text without a code, or with an unknown one, stays English. */
export function translateServerText(text: string, key: Key | null | undefined): string {
  const template =
    key && catalogue && Object.hasOwn(catalogue, key.code) ? catalogue[key.code as ServerCode] : undefined;
  if (!key || template === undefined) return joinUnits(text);
  const filled = template.replace(
    /\{\{|\}\}|\{(\w+):([^}]*)\}/g,
    (match: string, name: string | undefined, type: string) => {
      if (name === undefined) return match.charAt(0);
      const value = key.params[name];
      return value === undefined ? "" : formatParameter(value, type);
    },
  );
  return joinUnits(filled);
}

/** Translate the texts of a figure or table at their JSON pointers. */
export function translatePlaced<Content extends { texts?: Schemas["PlacedText"][] }>(
  content: Content,
): Content {
  if (!catalogue || !content.texts?.length) return content;
  const translated = structuredClone(content);
  for (const key of content.texts) for (const place of key.places) replaceAt(translated, place, key);
  return translated;
}

/** Translate the text at a JSON pointer. */
function replaceAt(content: object, pointer: string, key: Key) {
  const path = pointer.split("/").slice(1);
  const name = path.pop() ?? "";
  let parent: unknown = content;
  for (const part of path) parent = (parent as Record<string, unknown> | undefined)?.[part];
  const container = parent as Record<string, unknown> | undefined;
  if (typeof container?.[name] === "string") container[name] = translateServerText(container[name], key);
}

/** Format a parameter by its type; see `backend/kata/messages.py`. */
function formatParameter(value: unknown, type: string): string {
  if (type === "text") return nested(value as Nested);
  if (type === "sentence") return translateServerText((value as Nested).text, value as Nested);
  if (type === "texts") return (value as Nested[]).map(nested).join("、");
  if (typeof value !== "number") return String(value);
  const digits = Number(type.slice(1, -1));
  if (type.endsWith("f")) return value.toFixed(digits);
  if (type.endsWith("g")) return String(Number(value.toPrecision(type === "g" ? 6 : digits)));
  return String(value);
}

/** Return a nested text without its full stop. */
const nested = (text: Nested) => withoutFullStop(translateServerText(text.text, text));

export const withoutFullStop = (text: string) => text.replace(/[.。]$/, "");
