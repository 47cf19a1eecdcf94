import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the modules that use them.
await addTexts("fleet", {
  en: () => import("../../locales/en/fleet.json"),
  ja: () => import("../../locales/ja/fleet.json"),
});
