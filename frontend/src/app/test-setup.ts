import { beforeEach } from "vitest";
import { authStore } from "../features/auth/authState";
import { ME } from "../features/auth/examples";

// Mantine asks the browser for things that jsdom does not have.
Object.defineProperty(window, "matchMedia", {
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
// A text area that grows looks again once its font has come.
Object.defineProperty(document, "fonts", { value: new EventTarget() });

// Nothing is shown to nobody.
beforeEach(() => authStore.came(ME));
