import { addTexts } from "../../lib/lateTexts";

// The first page is at its limit of size: these texts load with the card.
await addTexts("rhythm", {
  en: () => import("../../locales/en/rhythm.json"),
  ja: () => import("../../locales/ja/rhythm.json"),
});
