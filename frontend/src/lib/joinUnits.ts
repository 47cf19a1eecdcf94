/** Name of the post-processor of texts. */
export const UNITS = "units";

const BEFORE_UNIT =
  /(\d) (?=(?:%|s|ms|min|h|Nm|N|J|Hz|A|mA|V|W|°C|mm|kg|kB|MB|GB|minutes?|sessions? per week)(?![A-Za-z\d]))/g;

/** Places within a Japanese date such as 2026年11月21日, and within a range of numbers such as −7.0〜70.2点. */
const WITHIN_DATE_OR_RANGE =
  /(?<=\d)(?=[年月日])|(?<=\d年|\d月)(?=\d)|(?<=[\d°%])(?=〜[−\d])|(?<=[\d°%]〜)(?=[−\d])|(?<=〜−?[\d.,]+)(?=点)/g;
/** Forbids a line break, and is not seen. */
const WORD_JOINER = "\u2060";

/** Return a text in which no line breaks between a number and its unit, within a Japanese date, or within a range. */
export const joinUnits = (text: string): string =>
  text.replace(BEFORE_UNIT, "$1\u00a0").replace(WITHIN_DATE_OR_RANGE, WORD_JOINER);

/** Return the text as a user types it. */
export const withoutJoiners = (text: string): string => text.replaceAll(WORD_JOINER, "");
