/**
 * Call `then` when the browser is idle, or after `longest_ms`. Return a function that cancels the call.
 */
export function whenIdle(then: () => void, longest_ms?: number): () => void {
  if (!("requestIdleCallback" in window)) {
    const timer = setTimeout(then);
    return () => clearTimeout(timer);
  }
  const handle = window.requestIdleCallback(then, longest_ms === undefined ? {} : { timeout: longest_ms });
  return () => window.cancelIdleCallback(handle);
}
