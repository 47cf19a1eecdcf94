import type { Schemas } from "../../lib/api/client";
import { formatMeasured } from "../../lib/format";
import { LANGUAGE } from "../../lib/language";

/** Return a score of 0 to 100, or a dash if there is none. */
export const formatScore = (value: number | null | undefined) => formatMeasured(value);

/** Return the names of measured motions and questionnaire items. The service sends them in both languages. */
export const measureName = (measure: Schemas["RomMeasure"]) =>
  LANGUAGE === "ja" ? measure.name_ja : measure.name;
export const itemName = (item: Schemas["SpadiItem"]) => (LANGUAGE === "ja" ? item.text_ja : item.text);
