import type { QueryClient } from "@tanstack/react-query";
import type { Middleware } from "openapi-fetch";
import { forgetDrafts } from "../../lib/draft";
import type { LiveStore } from "../../lib/live/store";
import { controlsArm } from "../../safety/modes";
import type { AuthStore } from "./authState";

/**
 * Interval between checks that the login is still valid. A sign-out elsewhere also closes the socket, which the
 * page notices sooner.
 */
const CHECK_EVERY_MS = 5_000;
/** Time after which user activity no longer counts for a request. */
const ACTIVITY_COUNTS_MS = 10_000;
const CHANNEL = "kata.access";
const ACTIVITY_EVENTS = ["pointerdown", "keydown", "wheel", "touchmove"] as const;

/**
 * Tracks when the user last acted on this page, and which addresses the page has requested since the user
 * opened it.
 */
export class ActivityTracker {
  #lastAt: number;
  #requested = new Set<string>();
  #now: () => number;

  constructor(now: () => number = () => performance.now()) {
    this.#now = now;
    this.#lastAt = now();
  }

  record = () => {
    this.#lastAt = this.#now();
  };

  /** Record that the user opens a page, so that its first requests count as views. */
  open = () => this.#requested.clear();

  /** Return whether the open page has requested this address before. */
  isRefresh(url: string): boolean {
    const repeated = this.#requested.has(url);
    this.#requested.add(url);
    return repeated;
  }

  /** Return the milliseconds since the last activity. Requests by timers are no activity. */
  idleMs = (): number => this.#now() - this.#lastAt;
}

/**
 * Reports user activity to the service, and marks refreshes, which the audit trail does not record as views.
 * Signs out or locks the page when an answer requires it.
 */
export function authMiddleware(auth: AuthStore, activity: ActivityTracker): Middleware {
  const sentAfter = new WeakMap<Request, number>();
  return {
    onRequest({ request }) {
      sentAfter.set(request, auth.signIns);
      if (activity.idleMs() < ACTIVITY_COUNTS_MS) request.headers.set("X-Kata-Active", "1");
      if (request.method === "GET" && activity.isRefresh(request.url))
        request.headers.set("X-Kata-Refresh", "1");
      return request;
    },
    async onResponse({ request, response }) {
      if (response.status !== 401 && response.status !== 423) return;
      const problem: unknown = await response
        .clone()
        .json()
        .catch(() => null);
      const code = (problem as { code?: unknown } | null)?.code;
      // A user who opens a link is asked for before the link has signed in, and the refusal can come after it.
      if (code === "not_signed_in" && sentAfter.get(request) === auth.signIns) auth.signedOut();
      else if (code === "locked") await auth.refresh();
    },
  };
}

/**
 * Connect the live socket only while signed in. Return a function that follows the login, and one that
 * disconnects.
 */
function followLiveSocket(auth: AuthStore, store: LiveStore) {
  let disconnect: (() => void) | null = null;
  const stop = () => {
    disconnect?.();
    disconnect = null;
  };
  const follow = () => {
    const state = auth.get();
    // The service refuses live data to a user who must still set up a second factor.
    const connected = state.is === "locked" || (state.is === "in" && !state.me.enrolling);
    if (!connected) stop();
    else if (!disconnect) disconnect = store.start();
  };
  return { follow, stop };
}

/** Return a function that applies the language of a user who has just signed in. */
function followLanguage(auth: AuthStore, store: LiveStore, switchLanguage: (language: string) => void) {
  let languageOf: string | null = null;
  return () => {
    const state = auth.get();
    if (state.is === "out") languageOf = null;
    // Applied only at sign-in, because a language chosen in another browser must not reload this page during use.
    if (state.is === "in" && languageOf !== state.me.account_id) {
      languageOf = state.me.account_id;
      const live = store.get().live;
      if (!live || !controlsArm(live)) switchLanguage(state.me.language);
    }
  };
}

/**
 * Keep the page consistent with the login: check it regularly, lock after inactivity, notify the other tabs,
 * connect the live socket only while signed in, discard data when the user changes, and apply a new user's
 * language. Return a function that stops all of this.
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
  const socket = followLiveSocket(auth, store);
  const applyLanguage = followLanguage(auth, store, switchLanguage);
  let previous = auth.get().is;
  const discardData = () => {
    void queries.cancelQueries();
    queries.clear();
    activity.open();
    // A locked screen keeps drafts, but another user must not see them.
    if (auth.get().is === "out") forgetDrafts();
  };
  const onChange = () => {
    const { is } = auth.get();
    socket.follow();
    if (is !== previous && previous !== "unknown") otherTabs.postMessage(is);
    previous = is;
    applyLanguage();
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
    // A user without password and OpenID cannot unlock here. Such a login ends with its longest time.
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
    socket.stop();
  };
}
