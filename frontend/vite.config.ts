import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";

const service = "http://127.0.0.1:8000";

export default defineConfig({
  plugins: [react()],
  server: { proxy: { "/api": { target: service, ws: true } } },
  // The service puts a new word in its place each time it hands out the page (kata/web/page.py).
  html: { cspNonce: "KATA-NONCE" },
  // Plotly alone is larger than Vite likes; it is loaded only where a figure is looked at.
  // The manifest tells a test what the first page loads.
  build: { chunkSizeWarningLimit: 2000, manifest: true },
  // How fast a busy machine is, is nobody's question here.
  test: { environment: "jsdom", setupFiles: "src/test-setup.ts", testTimeout: 60_000 },
});
