import { cleanup, configure } from "@testing-library/react";
import { afterAll, beforeEach, vi } from "vitest";
import { authStore } from "../features/auth/authState";
import { ME } from "../features/auth/testUsers";

// What a test waits for loads later than after a second if the computer is busy.
configure({ asyncUtilTimeout: 30_000 });

// Define browser functions that Mantine calls and jsdom lacks.
Object.defineProperty(window, "matchMedia", {
  configurable: true,
  value: (query: string) => ({
    matches: false,
    media: query,
    addEventListener() {},
    removeEventListener() {},
  }),
});
class NoResizeObserver {
  observe() {}
  unobserve() {}
  disconnect() {}
}
window.ResizeObserver = NoResizeObserver;
window.HTMLElement.prototype.scrollIntoView = () => {};
window.HTMLElement.prototype.setPointerCapture = () => {};
// Mantine's growing text area measures again when fonts have loaded.
Object.defineProperty(document, "fonts", { value: new EventTarget(), configurable: true });

// Every test starts with a signed-in administrator.
beforeEach(() => authStore.signedIn(ME));

// Most test files share an environment, so each file must leave it unchanged.
afterAll(() => {
  cleanup();
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.unstubAllEnvs();
  localStorage.clear();
  sessionStorage.clear();
  document.body.replaceChildren();
});
