import i18next from "i18next";
import "./i18n";
import { LANGUAGE, type Language } from "./language";

/**
 * Load the texts of a namespace that the first page does not need, in the page's language. Each module that
 * uses such texts waits for them.
 */
export async function addTexts(
  namespace: string,
  catalogues: Record<Language, () => Promise<{ default: object }>>,
) {
  i18next.addResourceBundle(LANGUAGE, namespace, (await catalogues[LANGUAGE]()).default);
}
