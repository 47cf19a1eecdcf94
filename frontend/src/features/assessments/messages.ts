import type { Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { LANGUAGE } from "../../lib/language";

/** A score of 0 to 100; a dash where there is none. */
export const formatScore = (value: number | null | undefined) => formatDeg(value, 0);

/** What a motion that is measured is called, and an item of the questionnaire; the service has both languages. */
export const measureName = (one: Schemas["RomMeasure"]) => (LANGUAGE === "ja" ? one.name_ja : one.name);
export const itemName = (one: Schemas["SpadiItem"]) => (LANGUAGE === "ja" ? one.text_ja : one.text);
