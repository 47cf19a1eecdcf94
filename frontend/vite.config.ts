import { globSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import react from "@vitejs/plugin-react";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { checkCatalogues } from "./catalogues.mjs";
import { unwrapPlotly } from "./plotlyModule.ts";
import { writePreloads } from "./preloads.ts";

/** The service to which `npm run dev` sends requests. */
const service = process.env.KATA_SERVICE ?? "http://127.0.0.1:8000";

const COMPRESS_FROM_BYTES = 1000;

/**
 * Writes the script of the preloads, and a compressed copy of each script and style sheet, which the service sends to
 * browsers that accept it (kata/api/static_files.py). It reads the written files, because Vite completes names in
 * scripts until then.
 */
const written: Plugin = {
  name: "written",
  apply: "build",
  writeBundle({ dir = "" }, bundle) {
    const fileNames = [...Object.keys(bundle), writePreloads(dir)];
    for (const fileName of fileNames.filter((name) => /\.(js|css)$/.test(name))) {
      const file = join(dir, fileName);
      const source = readFileSync(file);
      if (source.length >= COMPRESS_FROM_BYTES) writeFileSync(`${file}.gz`, gzipSync(source, { level: 9 }));
    }
  },
};

const TESTS = "src/**/*.test.{ts,tsx}";

/** Test files that replace or reload modules, which other files must not see. */
const replacing = globSync(TESTS).filter((file) =>
  /\bvi\.(mock|doMock|resetModules)\(/.test(readFileSync(file, "utf8")),
);

/** A missing or surplus translation fails the build. */
const catalogues: Plugin = { name: "catalogues", buildStart: checkCatalogues };

/** Browsers compile Plotly while they load it, in another thread than the page's. */
const plotly: Plugin = {
  name: "plotly",
  apply: "build",
  transform: {
    filter: { id: /plotly-basic\.min\.js$/ },
    handler: (source) => ({ code: unwrapPlotly(source), map: null }),
  },
};

/** Texts that load late, by the modules that wait for them. No other module may wait for them. */
const LATE = /catalogue\.ts$|[\\/](commissioning|administration|locales)[\\/]/;

/** Rules for the modules that share a file. A browser loads six files at a time, and each file needs a round trip. */
const CHUNKS = [
  // One file for the first page, instead of two dozen that load one after the other.
  { name: "page", tags: ["$initial" as const], priority: 3 },
  // Libraries and parts that at least three pages use.
  { name: "shared", test: /node_modules|src[\\/](ui|lib)[\\/]/, minShareCount: 3, priority: 2 },
  // The rest that two pages use; small files are joined although a page then loads a little more than it needs.
  {
    name: "parts",
    test: (id: string) => !LATE.test(id),
    minShareCount: 2,
    entriesAware: true,
    entriesAwareMergeThreshold: 12_000,
    priority: 1,
  },
];

export default defineConfig({
  plugins: [react(), catalogues, plotly, written],
  server: { proxy: { "/api": { target: service, ws: true } } },
  // The service replaces this by a new nonce in each response (kata/api/static_files.py).
  html: { cspNonce: "KATA-NONCE" },
  // Plotly alone exceeds Vite's default limit; it loads only with a figure.
  // A test reads from the manifest what the first page loads.
  build: {
    chunkSizeWarningLimit: 2000,
    manifest: true,
    rolldownOptions: {
      output: {
        codeSplitting: { groups: CHUNKS },
        // Without the names of all pages that share a file.
        chunkFileNames: ({ name }) => `assets/${name.replace(/~.*/, "")}-[hash].js`,
      },
    },
  },
  test: {
    environment: "jsdom",
    setupFiles: "src/app/test-setup.ts",
    // Generous, so that a busy machine does not fail tests.
    testTimeout: 60_000,
    // Vitest leaves one processor free, which on two processors is half of them.
    maxWorkers: "100%",
    alias: {
      // The icons' ES modules are six thousand files, which Node would read for each test file. This is one file.
      "@tabler/icons-react": "@tabler/icons-react/dist/cjs/tabler-icons-react.cjs",
      // jsdom cannot draw.
      "plotly.js-basic-dist-min": join(import.meta.dirname, "src/ui/testPlotly.ts"),
    },
    // A new environment and the imports take two seconds for each file, so most files share theirs.
    projects: [
      { extends: true, test: { name: "shared", isolate: false, include: [TESTS], exclude: replacing } },
      { extends: true, test: { name: "isolated", include: replacing } },
    ],
  },
});
