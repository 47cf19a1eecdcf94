import { LANGUAGE } from "./language";

/**
 * What the service says in sentences, in Japanese; {1}, {2} stand for the values that it puts into some. Fetched where it is
 * needed; a page that does not get it shows the service's own English, rather than nothing.
 */
const SAID: Readonly<Record<string, string>> =
  LANGUAGE === "ja"
    ? await import("./told.ja.json").then(
        (file) => file.default,
        () => ({}),
      )
    : {};

const escaped = (text: string) => text.replace(/[.*+?^$()|[\]\\/]/g, "\\$&");

/** Those with values; the longer ones first, since a short one may hold a longer one's words. */
const WITH_VALUES = Object.entries(SAID)
  .filter(([english]) => english.includes("{1}"))
  .sort(([one], [other]) => other.length - one.length)
  .map(([english, said]) => ({
    pattern: new RegExp(`^${escaped(english).replace(/\{\d\}/g, "(.+?)")}$`),
    said,
  }));

const begun = (clause: string) => `${clause.charAt(0).toUpperCase()}${clause.slice(1)}.`;

/** What the service has said, in the page's language; a sentence that is not known stays as it is. */
export function told(sentence: string): string {
  const known = SAID[sentence] ?? SAID[begun(sentence)]?.replace(/。$/, "");
  if (known !== undefined || LANGUAGE === "en") return known ?? sentence;
  for (const { pattern, said } of WITH_VALUES) {
    const values = pattern.exec(sentence);
    if (values) return said.replace(/\{(\d)\}/g, (_, place: string) => told(values[Number(place)] ?? ""));
  }
  return sentence.includes("; ") ? sentence.split("; ").map(told).join("、") : sentence;
}
