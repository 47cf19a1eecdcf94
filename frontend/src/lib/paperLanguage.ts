import { useLocalStorage } from "@mantine/hooks";
import { LANGUAGE, type Language } from "./language";

/** In which language notes are drafted and reports are printed: the page's, until somebody chooses; remembered in this browser. */
export function usePaperLanguage() {
  return useLocalStorage<Language>({
    key: "kata.report-language",
    defaultValue: LANGUAGE,
    getInitialValueInEffect: false,
    // Whatever somebody else has written there.
    deserialize: (kept) => (kept === '"ja"' ? "ja" : "en"),
  });
}
