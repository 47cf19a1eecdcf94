/** Name of the post-processor of texts. */
export const UNITS = "units";

const BEFORE_UNIT =
  /(\d) (?=(?:%|s|ms|min|h|Nm|N|J|Hz|A|mA|V|W|°C|mm|kg|kB|MB|GB|minutes?|sessions? per week)(?![A-Za-z\d]))/g;

/** Return a text in which no line breaks between a number and its unit. */
export const joinUnits = (text: string): string => text.replace(BEFORE_UNIT, "$1\u00a0");
