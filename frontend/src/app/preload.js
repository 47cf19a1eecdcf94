// Loads the page's texts and the addressed page's scripts and styles beside the first script, which would ask for
// them one after the other. The build writes `preloads` before this text (frontend/preloads.ts).
const stored = (() => {
  try {
    return localStorage.getItem("kata.language");
  } catch {
    return null;
  }
})();
const language =
  stored === "en" || stored === "ja" ? stored : navigator.language.startsWith("ja") ? "ja" : "en";
const page = preloads.pages.find(([pattern]) => new RegExp(pattern).test(location.pathname));
for (const index of new Set([...preloads.first[language], ...(page ? page[1][language] : [])])) {
  const file = preloads.files[index];
  const link = document.createElement("link");
  if (file.endsWith(".css")) {
    link.rel = "preload";
    link.as = "style";
  } else link.rel = "modulepreload";
  // Vite gives the same to the elements that use the files, otherwise the browser would load them twice.
  link.crossOrigin = "";
  link.href = `/${file}`;
  document.head.append(link);
}
