import { afterEach, describe, expect, it, vi } from "vitest";
import { reachByKeyboard } from "./reachByKeyboard";

afterEach(() => vi.unstubAllGlobals());

/** Return a viewport of 100 px, a way to change the width of its content, and the observed elements. */
function viewportWith(contentPx: number) {
  const observed: Element[] = [];
  const disconnect = vi.fn();
  let resized = () => {};
  vi.stubGlobal(
    "ResizeObserver",
    class {
      constructor(callback: () => void) {
        resized = callback;
      }
      observe(element: Element) {
        observed.push(element);
      }
      disconnect = disconnect;
    },
  );
  const viewport = document.createElement("div");
  viewport.append(document.createElement("table"));
  let width = contentPx;
  Object.defineProperty(viewport, "clientWidth", { value: 100 });
  Object.defineProperty(viewport, "scrollWidth", { get: () => width });
  const resize = (px: number) => {
    width = px;
    resized();
  };
  return { viewport, resize, observed, disconnect };
}

describe("a scrolled area", () => {
  it("is reached by keyboard, with a name, only while its content is larger", () => {
    const { viewport, resize, observed, disconnect } = viewportWith(300);
    const leave = reachByKeyboard(viewport);
    expect(viewport.tabIndex).toBe(0);
    expect(viewport.getAttribute("role")).toBe("group");
    expect(viewport.getAttribute("aria-label")).toBe("Table that scrolls");
    expect(observed).toEqual([viewport, viewport.firstElementChild]);
    resize(100);
    expect(viewport.getAttributeNames()).toEqual([]);
    resize(101);
    expect(viewport.tabIndex).toBe(0);
    leave?.();
    expect(disconnect).toHaveBeenCalledOnce();
  });
});
