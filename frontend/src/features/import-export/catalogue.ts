import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the modules that use them.
await addTexts("import-export", {
  en: () => import("../../locales/en/import-export.json"),
  ja: () => import("../../locales/ja/import-export.json"),
});
