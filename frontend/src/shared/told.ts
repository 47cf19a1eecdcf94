import { LANGUAGE } from "./language";

/** Sentences of the service by their English; {1}, {2} stand for the values that it puts into some. */
type Said = Readonly<Record<string, string>>;
type Pattern = { pattern: RegExp; said: string };

const escaped = (text: string) => text.replace(/[.*+?^$()|[\]\\/]/g, "\\$&");

/** Those with values; the longer ones first, since a short one may hold a longer one's words. */
const withValues = (said: Said): Pattern[] =>
  Object.entries(said)
    .filter(([english]) => english.includes("{1}"))
    .sort(([one], [other]) => other.length - one.length)
    .map(([english, japanese]) => ({
      pattern: new RegExp(`^${escaped(english).replace(/\{\d\}/g, "(.+?)")}$`),
      said: japanese,
    }));

const known: { whole: Said; patterns: Pattern[] } = { whole: {}, patterns: [] };

/**
 * Fetch what the service says in the page's language, before the page is drawn. A page that does not get it shows the service's
 * own English, rather than nothing.
 */
export async function learn(): Promise<void> {
  if (LANGUAGE === "en") return;
  try {
    known.whole = (await import("./told.ja.json")).default;
    known.patterns = withValues(known.whole);
  } catch {
    // Not on this computer any more, perhaps: a newer page is.
  }
}

const begun = (clause: string) => `${clause.charAt(0).toUpperCase()}${clause.slice(1)}.`;

/** What the service has said, in the page's language; a sentence that is not known stays as it is. */
export function told(sentence: string): string {
  const whole = known.whole[sentence] ?? known.whole[begun(sentence)]?.replace(/。$/, "");
  if (whole !== undefined || LANGUAGE === "en") return whole ?? sentence;
  for (const { pattern, said } of known.patterns) {
    const values = pattern.exec(sentence);
    if (values) return said.replace(/\{(\d)\}/g, (_, place: string) => told(values[Number(place)] ?? ""));
  }
  return sentence.includes("; ") ? sentence.split("; ").map(told).join("、") : sentence;
}
