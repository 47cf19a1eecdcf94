import type { Schemas } from "../api/client";
import { LANGUAGE } from "./language";
import { told } from "./told";

/** Where a figure has words: what traces, axes and titles are called, what stands at the pointer, how a day is written. */
const WORDS = new Set(["name", "text", "hovertemplate", "tickformat"]);

/** The service writes a figure's words in English: the same figure in the page's language. */
export function spoken(figure: Schemas["Figure"]): Schemas["Figure"] {
  if (LANGUAGE === "en") return figure;
  return JSON.parse(JSON.stringify(figure), (key, value: unknown) =>
    typeof value === "string" && WORDS.has(key) ? told(value) : value,
  );
}
