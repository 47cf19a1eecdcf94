/** The product's name is the same in every language. */
const BRAND = { latin: "Kata", kanji: "肩型" };

/** The product name in Latin letters and kanji. */
export function Brand() {
  return (
    <>
      {BRAND.latin} <span lang="ja">{BRAND.kanji}</span>
    </>
  );
}
