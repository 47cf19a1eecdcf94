import type { QueryClient } from "@tanstack/react-query";
import type { Middleware } from "openapi-fetch";
import { forgetDrafts } from "../../lib/draft";
import type { LiveStore } from "../../lib/live/store";
import { isMoving } from "../../safety/modes";
import type { AuthStore } from "./authState";

/**
 * Interval of checks that the login is still valid. A sign-out elsewhere also closes the socket, which is
 * noticed sooner.
 */
const CHECK_EVERY_MS = 5_000;
/** How long user activity counts for the next request. */
const ACTIVITY_COUNTS_MS = 10_000;
const CHANNEL = "kata.access";
const ACTIVITY_EVENTS = ["pointerdown", "keydown", "wheel", "touchmove"] as const;

/** Tracks when the user last acted on this page. Requests by timers do not count. */
export class ActivityTracker {
  #lastAt: number;
  #now: () => number;

  constructor(now: () => number = () => performance.now()) {
    this.#now = now;
    this.#lastAt = now();
  }

  record = () => {
    this.#lastAt = this.#now();
  };

  /** Return the milliseconds since the last activity. */
  idleMs = (): number => this.#now() - this.#lastAt;
}

/** Reports user activity to the service, and signs out or locks the page when an answer demands it. */
export function authMiddleware(auth: AuthStore, activity: ActivityTracker): Middleware {
  return {
    onRequest({ request }) {
      if (activity.idleMs() < ACTIVITY_COUNTS_MS) request.headers.set("X-Kata-Active", "1");
      return request;
    },
    async onResponse({ response }) {
      if (response.status !== 401 && response.status !== 423) return;
      const problem: unknown = await response
        .clone()
        .json()
        .catch(() => null);
      const code = (problem as { code?: unknown } | null)?.code;
      if (code === "not_signed_in") auth.signedOut();
      else if (code === "locked") await auth.refresh();
    },
  };
}

/**
 * Keep the page consistent with the login: check it regularly, lock after inactivity, notify the other tabs,
 * connect the live socket only while signed in, discard data when the user changes, and apply a new user's
 * language. Return a function that stops all this.
 */
export function startSessionGuard(
  auth: AuthStore,
  activity: ActivityTracker,
  queries: QueryClient,
  store: LiveStore,
  switchLanguage: (language: string) => void,
): () => void {
  const otherTabs = new BroadcastChannel(CHANNEL);
  otherTabs.onmessage = () => void auth.refresh();
  let disconnect: (() => void) | null = null;
  let previous = auth.get().is;
  let languageOf: string | null = null;
  const discardData = () => {
    void queries.cancelQueries();
    queries.clear();
    // A locked screen keeps drafts. Another user must not see them.
    if (auth.get().is === "out") forgetDrafts();
  };
  const onChange = () => {
    const state = auth.get();
    const { is } = state;
    // The service refuses live data to a user who must still set up a second factor.
    const connected = is === "locked" || (is === "in" && !state.me.enrolling);
    if (connected && !disconnect) disconnect = store.start();
    if (!connected && disconnect) {
      disconnect();
      disconnect = null;
    }
    if (is !== previous && previous !== "unknown") otherTabs.postMessage(is);
    previous = is;
    if (is === "out") languageOf = null;
    // Only at sign-in: a language chosen in another browser must not reload this page during use.
    if (is === "in" && languageOf !== state.me.account_id) {
      languageOf = state.me.account_id;
      const mode = store.get().live?.mode;
      if (mode === undefined || !isMoving(mode)) switchLanguage(state.me.language);
    }
  };
  const subscriptions = [
    auth.onUserChange(discardData),
    auth.subscribe(onChange),
    store.onLost(() => void auth.refresh()),
  ];
  for (const event of ACTIVITY_EVENTS)
    window.addEventListener(event, activity.record, { capture: true, passive: true });
  const onVisible = () => {
    if (document.visibilityState === "visible") void auth.refresh();
  };
  document.addEventListener("visibilitychange", onVisible);
  const timer = setInterval(() => {
    const state = auth.get();
    // A user without password and OpenID cannot unlock here. The service ends their login.
    const canUnlock = state.is === "in" && (state.me.password || state.me.openid);
    const idle = canUnlock && activity.idleMs() > 1000 * state.me.idle_s;
    void (idle ? auth.lock() : auth.refresh());
  }, CHECK_EVERY_MS);
  void auth.refresh();
  return () => {
    clearInterval(timer);
    document.removeEventListener("visibilitychange", onVisible);
    for (const event of ACTIVITY_EVENTS)
      window.removeEventListener(event, activity.record, { capture: true });
    for (const unsubscribe of subscriptions) unsubscribe();
    otherTabs.close();
    disconnect?.();
  };
}
