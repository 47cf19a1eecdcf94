import { t } from "../../lib/i18n";

const STOPS: Partial<Record<string, string>> = t("sessions:stops", { returnObjects: true });

/**
 * Return a stop's cause in words. A code that only an older or newer service knows is returned with spaces
 * instead of underscores.
 */
export const describeStop = (code: string) =>
  (Object.hasOwn(STOPS, code) ? STOPS[code] : undefined) ?? code.replaceAll("_", " ");
