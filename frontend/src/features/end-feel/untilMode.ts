import type { Live } from "../../lib/api/client";
import type { LiveState, LiveStore } from "../../lib/live/store";
import { HOLD_MS } from "../../safety/useHold";

type Store = Pick<LiveStore, "get" | "subscribe">;

/** Later than this, the user begins at the start by a press. It is longer than any way to a start. */
const AT_START_WITHIN_MS = 120_000;

type Wanted = {
  mode: Live["mode"];
  runId: string;
  within_ms: number;
  /** True if the arm must also be at the run's start. */
  atStart?: boolean;
  /** Aborts when the user lets go. */
  released?: AbortSignal;
};

const isAtStart = ({ live }: LiveState) =>
  live?.mode === "paused" && live.run?.at_start === true && !live.run.reversing;

/**
 * Wait until a run is in a mode. Return false if the apparatus stops, the run ends, the connection is lost, the user lets
 * go, or the time is over, so that no later command follows.
 */
export function untilMode(store: Store, wanted: Wanted): Promise<boolean> {
  const { released } = wanted;
  return new Promise((resolve) => {
    let seen = false;
    let unsubscribe = () => {};
    const end = (reached: boolean) => {
      clearTimeout(timeout);
      unsubscribe();
      released?.removeEventListener("abort", look);
      resolve(reached);
    };
    const look = () => {
      const { connected, live } = store.get();
      const isThis = live?.run?.run_id === wanted.runId;
      // The answer to a command may be faster than the state that shows its result.
      seen = seen || isThis;
      if (released?.aborted || !connected || live?.stop || (seen && !isThis)) end(false);
      else if (isThis && live?.mode === wanted.mode && (!wanted.atStart || isAtStart(store.get()))) end(true);
    };
    const timeout = setTimeout(() => end(false), wanted.within_ms);
    unsubscribe = store.subscribe(look);
    released?.addEventListener("abort", look);
    look();
  });
}

/**
 * Return true if the user still holds the button a second after the arm has reached the run's start. Return false as
 * soon as the user lets go or anything else happens.
 */
export async function isHeldAtStart(store: Store, runId: string, released: AbortSignal): Promise<boolean> {
  const wanted = { mode: "paused", runId, atStart: true, released } as const;
  if (!(await untilMode(store, { ...wanted, within_ms: AT_START_WITHIN_MS }))) return false;
  await new Promise<void>((resolve) => {
    const timeout = setTimeout(resolve, HOLD_MS);
    released.addEventListener("abort", () => {
      clearTimeout(timeout);
      resolve();
    });
  });
  return untilMode(store, { ...wanted, within_ms: 0 });
}
