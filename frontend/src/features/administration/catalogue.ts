import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit and few people administer, so these texts load with the modules that use
// them.
await addTexts("administration", {
  en: () => import("../../locales/en/administration.json"),
  ja: () => import("../../locales/ja/administration.json"),
});
