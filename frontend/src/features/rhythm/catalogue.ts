import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the card.
await addTexts("rhythm", {
  en: () => import("../../locales/en/rhythm.json"),
  ja: () => import("../../locales/ja/rhythm.json"),
});
