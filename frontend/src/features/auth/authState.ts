import { api, type Me, ProblemError } from "../../lib/api/client";

/** Who is signed in at this browser, as the service last said it. */
export type AuthState =
  /** Not asked yet, or no answer yet. */
  | { is: "unknown" }
  /** Nobody. Why, where somebody was until now; "unheard": the service has not confirmed the sign-out yet. */
  | { is: "out"; why: "never" | "ended" | "left" | "unheard" }
  /** Somebody, who has to give the password again. Stop still works. */
  | { is: "locked"; me: Me }
  | { is: "in"; me: Me };

/** What the standing is learned by. */
export interface Asked {
  /** Whoever is signed in; null: nobody. Throws where there is no answer. */
  me: () => Promise<Me | null>;
  lock: () => Promise<unknown>;
  signOut: () => Promise<unknown>;
}

/**
 * The page's one word on who is signed in. It fails closed: it is locked or left as soon as somebody wants that, though no
 * service answers; that is told again with every look until it is heard, and only the service can take it back.
 */
export class AuthStore {
  #standing: AuthState = { is: "unknown" };
  #listeners = new Set<() => void>();
  #leaving = new Set<() => void>();
  /** What the service has not heard yet. */
  #unheard: "lock" | "sign out" | null = null;
  #question = 0;
  #asked: Asked;

  constructor(asked: Asked) {
    this.#asked = asked;
  }

  get = (): AuthState => this.#standing;

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => {
      this.#listeners.delete(listener);
    };
  };

  /** Called before what is shown changes hands: when it is locked, when somebody leaves, and when somebody comes. */
  onLeaving(listener: () => void): () => void {
    this.#leaving.add(listener);
    return () => this.#leaving.delete(listener);
  }

  /** Ask the service. Without an answer it stays as it is. */
  async look(): Promise<void> {
    this.#question += 1;
    const question = this.#question;
    let me: Me | null;
    try {
      me = await this.#asked.me();
    } catch {
      return;
    }
    // Somebody signed in or out meanwhile: this answer is of before.
    if (question !== this.#question) return;
    if (!me) this.left();
    else if (this.#unheard) await this.#tell();
    else this.#set(me.locked ? { is: "locked", me } : { is: "in", me });
  }

  /** Somebody has signed in, or unlocked the screen. */
  came(me: Me): void {
    this.#question += 1;
    this.#unheard = null;
    this.#set(me.locked ? { is: "locked", me } : { is: "in", me });
  }

  /** The service says that nobody is signed in here. */
  left(): void {
    this.#question += 1;
    const unheard = this.#unheard;
    this.#unheard = null;
    const before = this.#standing;
    if (unheard === "sign out") this.#set({ is: "out", why: "left" });
    else if (before.is !== "out") this.#set({ is: "out", why: before.is === "unknown" ? "never" : "ended" });
  }

  /** Hide what is shown, at once, and tell the service. */
  async lock(): Promise<void> {
    const before = this.#standing;
    if (before.is !== "in") return;
    this.#question += 1;
    this.#unheard = "lock";
    this.#set({ is: "locked", me: { ...before.me, locked: true } });
    await this.#tell();
  }

  /** Leave: what is shown goes at once, and the service is told. */
  async signOut(): Promise<void> {
    this.#question += 1;
    this.#unheard = "sign out";
    this.#set({ is: "out", why: "unheard" });
    await this.#tell();
  }

  async #tell() {
    const telling = this.#unheard;
    if (!telling) return;
    try {
      await (telling === "lock" ? this.#asked.lock() : this.#asked.signOut());
    } catch {
      // Told again with the next look.
      return;
    }
    if (telling === "sign out") this.left();
    else if (this.#unheard === telling) this.#unheard = null;
  }

  #set(next: AuthState) {
    const before = this.#standing;
    if (JSON.stringify(before) === JSON.stringify(next)) return;
    const same = before.is === "in" && next.is === "in" && before.me.account_id === next.me.account_id;
    this.#standing = next;
    if (!same) for (const listener of this.#leaving) listener();
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
