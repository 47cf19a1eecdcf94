import type { Live } from "../../lib/api/client";
import type { LiveStore } from "../../lib/live/store";

/**
 * Wait until a run is in a mode. Return false if the apparatus stops, the run ends, the connection is lost, or the time
 * is over, so that no later command follows.
 */
export function untilMode(
  store: Pick<LiveStore, "get" | "subscribe">,
  wanted: { mode: Live["mode"]; runId: string; within_ms: number },
): Promise<boolean> {
  return new Promise((resolve) => {
    let seen = false;
    let unsubscribe = () => {};
    const end = (reached: boolean) => {
      clearTimeout(timeout);
      unsubscribe();
      resolve(reached);
    };
    const look = () => {
      const { connected, live } = store.get();
      const isThis = live?.run?.run_id === wanted.runId;
      // The answer to a command may be faster than the state that shows its result.
      seen = seen || isThis;
      if (!connected || live?.stop || (seen && !isThis)) end(false);
      else if (isThis && live?.mode === wanted.mode) end(true);
    };
    const timeout = setTimeout(() => end(false), wanted.within_ms);
    unsubscribe = store.subscribe(look);
    look();
  });
}
