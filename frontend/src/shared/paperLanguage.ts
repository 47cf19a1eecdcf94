import { useLocalStorage } from "@mantine/hooks";

export type PaperLanguage = "en" | "ja";

/** In which language notes are drafted and reports are printed: the browser's, until somebody chooses; remembered in this browser. */
export function usePaperLanguage() {
  return useLocalStorage<PaperLanguage>({
    key: "kata.report-language",
    defaultValue: navigator.language.startsWith("ja") ? "ja" : "en",
    getInitialValueInEffect: false,
    // Whatever somebody else has written there.
    deserialize: (kept) => (kept === '"ja"' ? "ja" : "en"),
  });
}
