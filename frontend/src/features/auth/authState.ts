import { api, type Me, ProblemError } from "../../lib/api/client";
import { setClinicZone } from "../../lib/days";

/** The user of this browser, as the service last reported. */
export type AuthState =
  /** The service has not answered yet. */
  | { is: "unknown" }
  /**
   * The user is signed out. `why` is the reason if a user was signed in. "unheard": the service has not
   * confirmed the sign-out yet.
   */
  | { is: "out"; why: "never" | "ended" | "left" | "unheard" }
  /** The user is signed in, but must enter the password again. Stop still works. */
  | { is: "locked"; me: Me }
  | { is: "in"; me: Me };

/** The service's calls that AuthStore uses. */
interface AuthApi {
  /** Return the signed-in user, or null without one. Throw if there is no answer. */
  me: () => Promise<Me | null>;
  lock: () => Promise<unknown>;
  signOut: () => Promise<unknown>;
}

/**
 * Holds the authentication state of the page. It fails closed: lock and sign-out take effect at once, without
 * waiting for the service. The request is repeated until the service confirms it, and only the service can undo
 * the state.
 */
export class AuthStore {
  #state: AuthState = { is: "unknown" };
  #listeners = new Set<() => void>();
  #userChangeListeners = new Set<() => void>();
  /** The request that the service has not confirmed yet. */
  #unconfirmed: "lock" | "sign out" | null = null;
  #requests = 0;
  #signIns = 0;
  #api: AuthApi;

  constructor(api: AuthApi) {
    this.#api = api;
  }

  get = (): AuthState => this.#state;

  /** Number of sign-ins on this page. An answer to a request from before the last one says nothing about the login. */
  get signIns(): number {
    return this.#signIns;
  }

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => {
      this.#listeners.delete(listener);
    };
  };

  /** Register a listener that is called before a lock, a sign-out or a change of user. */
  onUserChange(listener: () => void): () => void {
    this.#userChangeListeners.add(listener);
    return () => this.#userChangeListeners.delete(listener);
  }

  /** Ask the service for the current user. Without an answer the state does not change. */
  async refresh(): Promise<void> {
    this.#requests += 1;
    const request = this.#requests;
    let me: Me | null;
    try {
      me = await this.#api.me();
    } catch {
      return;
    }
    // The user has signed in or out meanwhile, so this answer is outdated.
    if (request !== this.#requests) return;
    if (!me) this.signedOut();
    else if (this.#unconfirmed) await this.#sendUnconfirmed();
    else this.#set(me.locked ? { is: "locked", me } : { is: "in", me });
  }

  /** Record a sign-in or an unlock. */
  signedIn(me: Me): void {
    this.#requests += 1;
    this.#signIns += 1;
    this.#unconfirmed = null;
    this.#set(me.locked ? { is: "locked", me } : { is: "in", me });
  }

  /** Record that the service reports no signed-in user. */
  signedOut(): void {
    this.#requests += 1;
    const unconfirmed = this.#unconfirmed;
    this.#unconfirmed = null;
    const before = this.#state;
    if (unconfirmed === "sign out") this.#set({ is: "out", why: "left" });
    else if (before.is !== "out") this.#set({ is: "out", why: before.is === "unknown" ? "never" : "ended" });
  }

  /** Lock at once, then send the lock to the service. */
  async lock(): Promise<void> {
    const before = this.#state;
    if (before.is !== "in") return;
    this.#requests += 1;
    this.#unconfirmed = "lock";
    this.#set({ is: "locked", me: { ...before.me, locked: true } });
    await this.#sendUnconfirmed();
  }

  /** Sign out at once, then send the sign-out to the service. */
  async signOut(): Promise<void> {
    this.#requests += 1;
    this.#unconfirmed = "sign out";
    this.#set({ is: "out", why: "unheard" });
    await this.#sendUnconfirmed();
  }

  async #sendUnconfirmed() {
    const sent = this.#unconfirmed;
    if (!sent) return;
    try {
      await (sent === "lock" ? this.#api.lock() : this.#api.signOut());
    } catch {
      // The next refresh repeats the request.
      return;
    }
    if (sent === "sign out") this.signedOut();
    else if (this.#unconfirmed === sent) this.#unconfirmed = null;
  }

  #set(next: AuthState) {
    const before = this.#state;
    if (JSON.stringify(before) === JSON.stringify(next)) return;
    const sameUser = before.is === "in" && next.is === "in" && before.me.account_id === next.me.account_id;
    this.#state = next;
    if (next.is === "in" || next.is === "locked") setClinicZone(next.me.time_zone);
    if (!sameUser) for (const listener of this.#userChangeListeners) listener();
    for (const listener of this.#listeners) listener();
  }
}

export const authStore = new AuthStore({
  me: async () => {
    try {
      return await api.me();
    } catch (error) {
      if (error instanceof ProblemError && error.code === "not_signed_in") return null;
      throw error;
    }
  },
  lock: api.lockScreen,
  signOut: api.signOut,
});
