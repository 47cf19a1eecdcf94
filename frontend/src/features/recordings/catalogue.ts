import { addTexts } from "../../lib/lazyTexts";

// The first page is at its size limit, so these texts load with the recording's page.
await addTexts("recordings", {
  en: () => import("../../locales/en/recordings.json"),
  ja: () => import("../../locales/ja/recordings.json"),
});
