/**
 * The page's language: the signed-in user's choice, else the language last used in this browser, else the
 * browser's own language. A change reloads the page, so that every text, date and figure is in one language.
 * Import this module before any other.
 */
export type Language = "en" | "ja";

/** The name of each language in that language. */
export const LANGUAGES: Record<Language, string> = { en: "English", ja: "日本語" };

const STORAGE_KEY = "kata.language";

// Without a language (LANG=C), Chromium reports "en-US@posix", which Intl refuses. A library that passes it to Intl
// while loading would leave the page empty.
try {
  Intl.getCanonicalLocales(navigator.language);
} catch {
  Object.defineProperty(navigator, "language", { value: "en-US", configurable: true });
}

const isLanguage = (value: string | null): value is Language => value !== null && value in LANGUAGES;

/** Return the stored language, or null if none is stored or storage is unavailable. */
function readStored(): string | null {
  try {
    return localStorage.getItem(STORAGE_KEY);
  } catch {
    return null;
  }
}

function initialLanguage(): Language {
  const stored = readStored();
  if (isLanguage(stored)) return stored;
  return navigator.language.startsWith("ja") ? "ja" : "en";
}

export const LANGUAGE: Language = initialLanguage();

/** The locale of dates and numbers: that of the browser if its language is the page's, else the page's language. */
export const LOCALE = navigator.language.startsWith(LANGUAGE) ? navigator.language : LANGUAGE;

document.documentElement.lang = LANGUAGE;

/**
 * Store the language and reload the page if it differs. Do nothing if storage is unavailable, because the page
 * would then reload endlessly.
 */
export function switchLanguage(language: string): void {
  if (!isLanguage(language) || language === LANGUAGE) return;
  try {
    localStorage.setItem(STORAGE_KEY, language);
  } catch {
    return;
  }
  if (readStored() === language) location.reload();
}
