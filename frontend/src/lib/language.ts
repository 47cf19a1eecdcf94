/**
 * In which language the page speaks, from its loading to its leaving: what whoever is signed in has chosen, else what it last
 * spoke at this browser, else the browser's own. A change loads the page anew, so that every text, date and figure on it
 * is in one language, also those that are no component's. To be imported before any other.
 */
export type Language = "en" | "ja";

/** What each language calls itself. */
export const LANGUAGES: Record<Language, string> = { en: "English", ja: "日本語" };

const KEPT = "kata.language";

// Chromium started without a language (LANG=C) calls its own "en-US@posix", which Intl then refuses: a library that hands
// it on as it loads would leave the page white.
try {
  Intl.getCanonicalLocales(navigator.language);
} catch {
  Object.defineProperty(navigator, "language", { value: "en-US", configurable: true });
}

const isLanguage = (told: string | null): told is Language => told !== null && told in LANGUAGES;

/** What was last spoken here; null where nothing was, or the browser keeps nothing. */
function remembered(): string | null {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

function chosen(): Language {
  const kept = remembered();
  if (isLanguage(kept)) return kept;
  return navigator.language.startsWith("ja") ? "ja" : "en";
}

export const LANGUAGE: Language = chosen();

/** How dates and numbers are written: as the browser's region has it, where that speaks the page's language. */
export const LOCALE = navigator.language.startsWith(LANGUAGE) ? navigator.language : LANGUAGE;

document.documentElement.lang = LANGUAGE;

/**
 * From now on the page speaks this: it is loaded anew where it spoke another. Of anything else than a language, nothing; and
 * nothing where the browser keeps nothing, since the page would be loaded again and again.
 */
export function speak(told: string): void {
  if (!isLanguage(told) || told === LANGUAGE) return;
  try {
    localStorage.setItem(KEPT, told);
  } catch {
    return;
  }
  if (remembered() === told) location.reload();
}
