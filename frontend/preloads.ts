import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import type { Manifest } from "vite";

const LANGUAGES = ["en", "ja"] as const;
const ROUTER = "src/app/router.tsx";
/** Fewer routes mean that the router's text is written in a way that this module does not read. */
const LEAST_ROUTES = 15;

type ByLanguage<Value> = Record<(typeof LANGUAGES)[number], Value>;

/** Return the modules that each top-level route of the router imports, by a pattern of its addresses. */
export function readRoutes(router: string): [string, string[]][] {
  return router
    .split("createRoute({")
    .slice(1)
    .flatMap((text): [string, string[]][] => {
      const route = text.slice(0, text.indexOf("\n});"));
      const path = /getParentRoute: \(\) => rootRoute,\s+path: "([^"]+)"/.exec(route)?.[1];
      const modules = [...route.matchAll(/import\("\.\.\/([^"]+)"\)/g)].map(([, name]) => `src/${name}.tsx`);
      if (path === undefined || modules.length === 0) return [];
      return [[`^${path.replaceAll(/\$\w+/g, "[^/]+")}/?$`, modules]];
    });
}

/** Return the scripts and styles that a chunk imports, and those texts that its modules load in a language. */
function filesOf(manifest: Manifest, start: string[], language: string): Set<string> {
  const chunks = new Set<string>();
  const visit = (name: string) => {
    const chunk = manifest[name];
    if (!chunk || chunks.has(name)) return;
    chunks.add(name);
    for (const imported of chunk.imports ?? []) visit(imported);
    for (const imported of chunk.dynamicImports ?? [])
      if (imported.startsWith(`src/locales/${language}/`)) visit(imported);
  };
  start.forEach(visit);
  return new Set([...chunks].flatMap((name) => [manifest[name]?.file ?? "", ...(manifest[name]?.css ?? [])]));
}

/**
 * Write the script that starts the preloads of each address into the built page. It is a file, because the
 * content security policy allows no inline scripts. Return its name.
 */
export function writePreloads(folder: string): string {
  const manifest = JSON.parse(readFileSync(join(folder, ".vite/manifest.json"), "utf8")) as Manifest;
  const index = readFileSync(join(folder, "index.html"), "utf8");
  const named = [...index.matchAll(/(?:src|href)="\/(assets\/[^"]+)"/g)].map(([, file]) => file ?? "");
  const entries = Object.keys(manifest).filter((name) => named.includes(manifest[name]?.file ?? ""));
  const routes = readRoutes(readFileSync(ROUTER, "utf8"));
  if (entries.length === 0 || routes.length < LEAST_ROUTES)
    throw new Error(`${entries.length} first scripts and ${routes.length} routes found`);
  const files: string[] = [];
  const indices = (start: string[], without: ByLanguage<Set<string>> | null) =>
    Object.fromEntries(
      LANGUAGES.map((language) => {
        const wanted = [...filesOf(manifest, start, language)].filter(
          (file) => !named.includes(file) && !without?.[language].has(file),
        );
        for (const file of wanted) if (!files.includes(file)) files.push(file);
        return [language, wanted.map((file) => files.indexOf(file))];
      }),
    );
  const first = indices(entries, null);
  const loaded = Object.fromEntries(
    LANGUAGES.map((language) => [language, filesOf(manifest, entries, language)]),
  ) as ByLanguage<Set<string>>;
  const pages = routes.map(([pattern, modules]) => [pattern, indices(modules, loaded)]);
  const source = readFileSync("src/app/preload.js", "utf8");
  const script = `{\nconst preloads = ${JSON.stringify({ files, first, pages })};\n${source}}\n`;
  const name = `assets/preload-${createHash("sha256").update(script).digest("base64url").slice(0, 8)}.js`;
  writeFileSync(join(folder, name), script);
  const scheme = '<script src="/scheme.js" nonce="KATA-NONCE"></script>';
  if (!index.includes(scheme)) throw new Error("index.html does not load /scheme.js");
  writeFileSync(
    join(folder, "index.html"),
    index.replace(scheme, `${scheme}\n    <script async src="/${name}" nonce="KATA-NONCE"></script>`),
  );
  return name;
}
