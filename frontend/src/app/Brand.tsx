import { BRAND } from "../lib/messages";

/** The product name in Latin letters and kanji. */
export function Brand() {
  return (
    <>
      {BRAND.latin} <span lang="ja">{BRAND.kanji}</span>
    </>
  );
}
