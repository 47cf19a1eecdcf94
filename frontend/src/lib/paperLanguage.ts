import { useLocalStorage } from "@mantine/hooks";
import { LANGUAGE, type Language } from "./language";

/**
 * Return the language of notes and printed reports: the page's language until the user chooses one. This
 * browser stores the choice.
 */
export function usePaperLanguage() {
  return useLocalStorage<Language>({
    key: "kata.report-language",
    defaultValue: LANGUAGE,
    getInitialValueInEffect: false,
    // Unknown stored values are ignored.
    deserialize: (stored) => (stored === '"ja"' ? "ja" : "en"),
  });
}
