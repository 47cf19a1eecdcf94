/** Name of the post-processor of texts. */
export const UNITS = "units";

const BEFORE_UNIT =
  /(\d) (?=(?:%|s|ms|min|h|Nm|N|J|Hz|A|mA|V|W|°C|mm|kg|kB|MB|GB|minutes?|sessions? per week)(?![A-Za-z\d]))/g;

const MONTH = "(?:Jan|Feb|Mar|Apr|May|June?|July?|Aug|Sept?|Oct|Nov|Dec)";
/** English dates: 12 Nov 2026 and Nov 12, 2026, and both without the year. */
const DATE = new RegExp(
  `\\b\\d{1,2} ${MONTH}\\b(?: \\d{4}\\b)?|\\b${MONTH} \\d{1,2}\\b(?:, \\d{4}\\b)?`,
  "g",
);
/** The word within −39.0 to −26.6 and 3 of 7. Two dates, or two numbers with uncertainties, are too long for one line. */
const ENGLISH_RANGE = /(?<=\d[°%]?)(?<!\u00a0\d{4}) (to|of) (?=[+−-]?\d)(?!\d{1,2}\u00a0[A-Z]|[\d.]+°? ±)/g;
/** The space before a unit in brackets, and within the name of a numbered thing. */
const BEFORE_BRACKET_OR_NUMBER = / (?=\[[^\][]{1,8}\])|(?<=\b(?:Station|Motor|Take|Version)) (?=\d)/g;

/** Places within a Japanese date such as 2026年11月21日, a range of numbers such as −7.0〜70.2点, and the name モータ5. */
const WITHIN_DATE_OR_RANGE =
  /(?<=\d)(?=[年月日])|(?<=\d年|\d月)(?=\d)|(?<=[\d°%])(?=〜[−\d])|(?<=[\d°%]〜)(?=[−\d])|(?<=〜−?[\d.,]+)(?=点)|(?<=ステーション|モータ)(?=\d)/g;
/** Forbids a line break, and is not seen. */
const WORD_JOINER = "\u2060";

/**
 * Return a text in which no line breaks between a number and its unit, within a date or a range, or between a name and its
 * number.
 */
export const joinUnits = (text: string): string =>
  text
    .replace(BEFORE_UNIT, "$1\u00a0")
    .replace(DATE, (date) => date.replaceAll(" ", "\u00a0"))
    .replace(ENGLISH_RANGE, "\u00a0$1\u00a0")
    .replace(BEFORE_BRACKET_OR_NUMBER, "\u00a0")
    .replace(WITHIN_DATE_OR_RANGE, WORD_JOINER);

/** Return the text as a user types it. */
export const withoutJoiners = (text: string): string =>
  text.replaceAll(WORD_JOINER, "").replaceAll("\u00a0", " ");
