import { type RefCallback, useCallback, useState } from "react";

/**
 * Return a ref for an element, and its width in CSS pixels. The width is known before the element is painted, so that
 * a drawing is never shown in another size first. `unknown`: the width where the browser has no layout.
 */
export function useWidth(unknown: number): { ref: RefCallback<Element>; width: number } {
  const [width, setWidth] = useState(unknown);
  const ref = useCallback(
    (element: Element | null) => {
      if (!element) return undefined;
      const measure = () => setWidth(element.clientWidth || unknown);
      measure();
      const observer = new ResizeObserver(measure);
      observer.observe(element);
      return () => observer.disconnect();
    },
    [unknown],
  );
  return { ref, width };
}
