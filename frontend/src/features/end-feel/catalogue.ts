import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the card.
await addTexts("endFeel", {
  en: () => import("../../locales/en/endFeel.json"),
  ja: () => import("../../locales/ja/endFeel.json"),
});
