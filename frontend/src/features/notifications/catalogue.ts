import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the modules that use them.
await addTexts("notifications", {
  en: () => import("../../locales/en/notifications.json"),
  ja: () => import("../../locales/ja/notifications.json"),
});
