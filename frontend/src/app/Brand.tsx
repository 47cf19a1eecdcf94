import { BRAND } from "../lib/messages";

/** Its name, in both scripts. */
export function Brand() {
  return (
    <>
      {BRAND.latin} <span lang="ja">{BRAND.kanji}</span>
    </>
  );
}
