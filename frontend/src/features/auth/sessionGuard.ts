import type { QueryClient } from "@tanstack/react-query";
import type { Middleware } from "openapi-fetch";
import { forgetDrafts } from "../../lib/draft";
import type { LiveStore } from "../../lib/live/store";
import { isMoving } from "../../safety/modes";
import type { AuthStore } from "./authState";

/** How often the page asks whether it is still signed in; a sign-out elsewhere also closes its socket, which is sooner. */
const LOOK_EVERY_MS = 5_000;
/** Doing something counts for the next request that is made within this time. */
const DOING_MS = 10_000;
const CHANNEL = "kata.access";
const ACTS = ["pointerdown", "keydown", "wheel", "touchmove"] as const;

/** When somebody last did something at this page. What the page asks by itself never counts. */
export class ActivityTracker {
  #at: number;
  #now: () => number;

  constructor(now: () => number = () => performance.now()) {
    this.#now = now;
    this.#at = now();
  }

  did = () => {
    this.#at = this.#now();
  };

  /** Milliseconds since then. */
  idleMs = (): number => this.#now() - this.#at;
}

/** Tells the service of somebody's doing, and the page of an answer that says: not signed in, or locked. */
export function authMiddleware(access: AuthStore, doing: ActivityTracker): Middleware {
  return {
    onRequest({ request }) {
      if (doing.idleMs() < DOING_MS) request.headers.set("X-Kata-Active", "1");
      return request;
    },
    async onResponse({ response }) {
      if (response.status !== 401 && response.status !== 423) return;
      const problem: unknown = await response
        .clone()
        .json()
        .catch(() => null);
      const code = (problem as { code?: unknown } | null)?.code;
      if (code === "not_signed_in") access.left();
      else if (code === "locked") await access.look();
    },
  };
}

/**
 * Keep what is shown and who is signed in together: ask again and again, lock after the time without doing, tell the other
 * tabs of this browser, have the live connection only while somebody is signed in, forget what was fetched when it
 * changes hands, and speak the language of whoever comes. Returns how to end it.
 */
export function startSessionGuard(
  access: AuthStore,
  doing: ActivityTracker,
  queries: QueryClient,
  store: LiveStore,
  speak: (language: string) => void,
): () => void {
  const others = new BroadcastChannel(CHANNEL);
  others.onmessage = () => void access.look();
  let hangUp: (() => void) | null = null;
  let known = access.get().is;
  let spokenTo: string | null = null;
  const forget = () => {
    void queries.cancelQueries();
    queries.clear();
    // A locked screen keeps what was typed; another account must not see it.
    if (access.get().is === "out") forgetDrafts();
  };
  const changed = () => {
    const standing = access.get();
    const { is } = standing;
    // Before they have their second factor, the service lets nobody listen.
    const listening = is === "locked" || (is === "in" && !standing.me.enrolling);
    if (listening && !hangUp) hangUp = store.start();
    if (!listening && hangUp) {
      hangUp();
      hangUp = null;
    }
    if (is !== known && known !== "unknown") others.postMessage(is);
    known = is;
    if (is === "out") spokenTo = null;
    // Only as somebody comes: what they choose at another browser does not load this one anew beneath their hands.
    if (is === "in" && spokenTo !== standing.me.account_id) {
      spokenTo = standing.me.account_id;
      const mode = store.get().live?.mode;
      if (mode === undefined || !isMoving(mode)) speak(standing.me.language);
    }
  };
  const ends = [access.onLeaving(forget), access.subscribe(changed), store.onLost(() => void access.look())];
  for (const act of ACTS) window.addEventListener(act, doing.did, { capture: true, passive: true });
  const visible = () => {
    if (document.visibilityState === "visible") void access.look();
  };
  document.addEventListener("visibilitychange", visible);
  const looking = setInterval(() => {
    const standing = access.get();
    // Whoever has neither could not unlock it here; their sign-in ends at the service.
    const unlocks = standing.is === "in" && (standing.me.password || standing.me.openid);
    const idle = unlocks && doing.idleMs() > 1000 * standing.me.idle_s;
    void (idle ? access.lock() : access.look());
  }, LOOK_EVERY_MS);
  void access.look();
  return () => {
    clearInterval(looking);
    document.removeEventListener("visibilitychange", visible);
    for (const act of ACTS) window.removeEventListener(act, doing.did, { capture: true });
    for (const end of ends) end();
    others.close();
    hangUp?.();
  };
}
