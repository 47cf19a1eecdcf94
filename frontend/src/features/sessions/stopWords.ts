import { t } from "../../lib/i18n";

const STOPS: Partial<Record<string, string>> = t("sessions:stops", { returnObjects: true });

/** Return a stop's cause in words; a code that an older or newer service has written, with blanks. */
export const stopWords = (code: string) =>
  (Object.hasOwn(STOPS, code) ? STOPS[code] : undefined) ?? code.replaceAll("_", " ");
