import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit and few people commission, so these texts load with the modules that use
// them.
await addTexts("commissioning", {
  en: () => import("../../locales/en/commissioning.json"),
  ja: () => import("../../locales/ja/commissioning.json"),
});
