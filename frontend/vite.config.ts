import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import react from "@vitejs/plugin-react";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

const service = "http://127.0.0.1:8000";

const WORTH_IT_BYTES = 1000;

/**
 * Beside each script and style sheet lies the same compressed, which the service sends to whoever takes it (kata/api/static_files.py). Made of
 * what has been written, because Vite puts names into scripts until then.
 */
const compressed: Plugin = {
  name: "compressed",
  apply: "build",
  writeBundle({ dir = "" }, bundle) {
    for (const fileName of Object.keys(bundle).filter((name) => /\.(js|css)$/.test(name))) {
      const written = join(dir, fileName);
      const source = readFileSync(written);
      if (source.length >= WORTH_IT_BYTES) writeFileSync(`${written}.gz`, gzipSync(source, { level: 9 }));
    }
  },
};

export default defineConfig({
  plugins: [react(), compressed],
  server: { proxy: { "/api": { target: service, ws: true } } },
  // The service puts a new word in its place each time it hands out the page (kata/api/static_files.py).
  html: { cspNonce: "KATA-NONCE" },
  // Plotly alone is larger than Vite likes; it is loaded only where a figure is looked at.
  // The manifest tells a test what the first page loads.
  build: {
    chunkSizeWarningLimit: 2000,
    manifest: true,
    // What the first page needs comes in one file, not in two dozen that wait for each other's turn.
    rolldownOptions: { output: { codeSplitting: { groups: [{ name: "page", tags: ["$initial"] }] } } },
  },
  // How fast a busy machine is, is nobody's question here.
  test: { environment: "jsdom", setupFiles: "src/app/test-setup.ts", testTimeout: 60_000 },
});
