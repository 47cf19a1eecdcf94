import { addTexts } from "../../lib/lateTexts";

// The first page is at its limit of size, and few people commission: these texts load with the modules that use them.
await addTexts("commissioning", {
  en: () => import("../../locales/en/commissioning.json"),
  ja: () => import("../../locales/ja/commissioning.json"),
});
