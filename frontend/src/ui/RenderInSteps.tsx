import { type ReactNode, useDeferredValue } from "react";

/**
 * Renders a large part of a page in small steps, because one large render blocks input for 0.25 s on a slow
 * tablet. `meanwhile` is shown until it is complete.
 */
export function RenderInSteps(props: { children: ReactNode; meanwhile: ReactNode }) {
  return useDeferredValue(true, false) ? props.children : props.meanwhile;
}
