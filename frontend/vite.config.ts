import { globSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import react from "@vitejs/plugin-react";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { checkCatalogues } from "./catalogues.mjs";

/** The service that `npm run dev` asks. */
const service = process.env.KATA_SERVICE ?? "http://127.0.0.1:8000";

const COMPRESS_FROM_BYTES = 1000;

/**
 * Writes a compressed copy of each script and style sheet, which the service sends to browsers that accept it
 * (kata/api/static_files.py). It reads the written files, because Vite completes names in scripts until then.
 */
const compressed: Plugin = {
  name: "compressed",
  apply: "build",
  writeBundle({ dir = "" }, bundle) {
    for (const fileName of Object.keys(bundle).filter((name) => /\.(js|css)$/.test(name))) {
      const written = join(dir, fileName);
      const source = readFileSync(written);
      if (source.length >= COMPRESS_FROM_BYTES)
        writeFileSync(`${written}.gz`, gzipSync(source, { level: 9 }));
    }
  },
};

const TESTS = "src/**/*.test.{ts,tsx}";

/** Test files that replace modules, which other files must not see. */
const replacing = globSync(TESTS).filter((file) =>
  /\bvi\.(mock|doMock|resetModules)\(/.test(readFileSync(file, "utf8")),
);

/** A missing or surplus translation fails the build. */
const catalogues: Plugin = { name: "catalogues", buildStart: checkCatalogues };

export default defineConfig({
  plugins: [react(), catalogues, compressed],
  server: { proxy: { "/api": { target: service, ws: true } } },
  // The service replaces this by a new nonce in each response (kata/api/static_files.py).
  html: { cspNonce: "KATA-NONCE" },
  // Plotly alone exceeds Vite's default limit; it loads only with a figure.
  // A test reads from the manifest what the first page loads.
  build: {
    chunkSizeWarningLimit: 2000,
    manifest: true,
    // One file for the first page, instead of two dozen that load one after the other.
    rolldownOptions: { output: { codeSplitting: { groups: [{ name: "page", tags: ["$initial"] }] } } },
  },
  test: {
    environment: "jsdom",
    setupFiles: "src/app/test-setup.ts",
    // Generous, so that a busy machine does not fail tests.
    testTimeout: 60_000,
    // Vitest leaves one processor free, which on two processors is half of them.
    maxWorkers: "100%",
    // The icons' ES modules are six thousand files, which Node would read for each test file. This is one file.
    alias: { "@tabler/icons-react": "@tabler/icons-react/dist/cjs/tabler-icons-react.cjs" },
    // A new environment and the imports take two seconds for each file, so most files share theirs.
    projects: [
      { extends: true, test: { name: "shared", isolate: false, include: [TESTS], exclude: replacing } },
      { extends: true, test: { name: "isolated", include: replacing } },
    ],
  },
});
