/**
 * Chromium started without a language (LANG=C) calls its own "en-US@posix", which Intl then refuses: a library that hands
 * it on as it loads would leave the page white. To be imported before any other.
 */
try {
  Intl.getCanonicalLocales(navigator.language);
} catch {
  Object.defineProperty(navigator, "language", { value: "en-US", configurable: true });
}

export {};
