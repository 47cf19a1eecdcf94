import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the modules that use them.
await addTexts("programmes", {
  en: () => import("../../locales/en/programmes.json"),
  ja: () => import("../../locales/ja/programmes.json"),
});
