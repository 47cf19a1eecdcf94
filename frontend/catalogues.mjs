/** Checks the catalogues of page texts against each other, and writes their types. Run by `npm run types` and by Vite. */
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const LOCALES = new URL("src/locales/", import.meta.url);
/** The reference language. The others must have its keys and parameters, and the types are made from its texts. */
const REFERENCE = "en";
const TRANSLATIONS = ["ja"];
/** Texts that are keyed by the service's codes (checked by tests/repo_checks/test_messages.py) and by Plotly's English. */
const LOADED_APART = ["plotly.json", "server.json"];

/** Return the catalogues of a language by namespace. */
function read(language) {
  const folder = new URL(`${language}/`, LOCALES);
  const names = readdirSync(folder).filter((name) => name.endsWith(".json") && !LOADED_APART.includes(name));
  return Object.fromEntries(
    names
      .sort()
      .map((name) => [name.replace(".json", ""), JSON.parse(readFileSync(new URL(name, folder), "utf8"))]),
  );
}

/** Return every text by its whole key: "station:lease.takeOver". */
function flatten(catalogue) {
  const texts = new Map();
  const walk = (value, key) => {
    if (typeof value === "string") texts.set(key, value);
    else for (const [name, inner] of Object.entries(value)) walk(inner, `${key}.${name}`);
  };
  for (const [namespace, keys] of Object.entries(catalogue))
    for (const [name, value] of Object.entries(keys)) walk(value, `${namespace}:${name}`);
  return texts;
}

const PLURAL = /_(zero|one|two|few|many|other)$/;

/** Return the texts by key without its plural form, and the parameters of each, without formats. */
function parameters(texts) {
  const found = new Map();
  for (const [key, text] of texts) {
    const names = found.get(key.replace(PLURAL, "")) ?? new Set(PLURAL.test(key) ? ["count"] : []);
    for (const [, name] of text.matchAll(/\{\{\s*(\w+)[^}]*\}\}/g)) names.add(name);
    found.set(key.replace(PLURAL, ""), names);
  }
  return found;
}

/** Return the errors of a translation: missing, surplus and empty texts, other parameters, missing plural forms. */
export function differences(reference, translation, language) {
  const [there, here] = [flatten(reference), flatten(translation)];
  const [wanted, given] = [parameters(there), parameters(here)];
  const wrong = [];
  for (const [key, names] of wanted) {
    const own = given.get(key);
    if (!own) wrong.push(`${language}: ${key} is missing`);
    else if ([...names].sort().join() !== [...own].sort().join())
      wrong.push(`${language}: ${key} has parameters ${[...own]} instead of ${[...names]}`);
  }
  for (const key of given.keys()) if (!wanted.has(key)) wrong.push(`${language}: ${key} is surplus`);
  for (const [key, text] of here)
    if (!text.trim() && there.get(key) !== text) wrong.push(`${language}: ${key} is empty`);
  const forms = new Intl.PluralRules(language).resolvedOptions().pluralCategories;
  const plurals = new Set(
    [...there.keys()].filter((key) => PLURAL.test(key)).map((key) => key.replace(PLURAL, "")),
  );
  for (const key of plurals)
    for (const form of forms)
      if (!here.has(`${key}_${form}`)) wrong.push(`${language}: ${key}_${form} is missing`);
  return wrong;
}

/** Return the reference's texts as a TypeScript type, from which i18next derives keys and parameters. */
const declaration = (reference) =>
  `// Made of locales/${REFERENCE} by catalogues.mjs.\nexport interface Resources ${JSON.stringify(reference, null, 2)}\n`;

/** Write the types. Throw an error for a translation that does not fit. */
export function checkCatalogues() {
  const reference = read(REFERENCE);
  const file = new URL("resources.d.ts", LOCALES);
  writeFileSync(file, declaration(reference));
  const wrong = [REFERENCE, ...TRANSLATIONS].flatMap((language) =>
    differences(reference, read(language), language),
  );
  if (wrong.length > 0) throw new Error(`Texts of the page:\n${wrong.join("\n")}`);
}

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) checkCatalogues();
