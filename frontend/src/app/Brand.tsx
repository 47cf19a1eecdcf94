/** The product's name, which is the same in every language. */
const BRAND = { latin: "Kata", kanji: "肩型" };

/** Shows the product's name in Latin letters and kanji. */
export function Brand() {
  return (
    <>
      {BRAND.latin} <span lang="ja">{BRAND.kanji}</span>
    </>
  );
}
