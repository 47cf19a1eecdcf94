import i18next, { type PostProcessorModule } from "i18next";
import { joinUnits, UNITS } from "./joinUnits";
import { LANGUAGE } from "./language";

// Modules use texts while they load, so they wait here for the catalogue. A catalogue must not import a module of
// the page, because the import would wait for itself.
const catalogue = LANGUAGE === "ja" ? await import("../locales/ja") : await import("../locales/en");

i18next.use({
  type: "postProcessor",
  name: UNITS,
  process: (text: unknown) => (typeof text === "string" ? joinUnits(text) : text),
} as PostProcessorModule);

await i18next.init({
  lng: LANGUAGE,
  fallbackLng: false,
  resources: { [LANGUAGE]: catalogue.default },
  // React already escapes every text.
  interpolation: { escapeValue: false },
  postProcess: UNITS,
});

/** Return a text of the page in its language: `t("station:lease.takeOver")`. Key and parameters are type-checked. */
export const t = i18next.t;
