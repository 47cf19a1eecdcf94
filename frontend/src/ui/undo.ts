/** An action that was just done, and a function that undoes it. */
export type Undoable = { words: string; undo: () => Promise<unknown> };

/** Time in milliseconds that is enough to read the offer and to reach the button with the tab key. */
const OFFERED_MS = 20_000;

/** Holds the last action that can be undone, for a limited time. It holds only one action. */
class UndoStore {
  #offer: Undoable | null = null;
  #timer: ReturnType<typeof setTimeout> | null = null;
  readonly #listeners = new Set<() => void>();

  get = () => this.#offer;

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => {
      this.#listeners.delete(listener);
    };
  };

  /** Offer to undo an action. This replaces the previous offer. */
  offer(offer: Undoable) {
    this.#set(offer);
    this.#timer = setTimeout(() => this.clear(), OFFERED_MS);
  }

  clear() {
    this.#set(null);
  }

  #set(offer: Undoable | null) {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = null;
    this.#offer = offer;
    for (const listener of this.#listeners) listener();
  }
}

export const undoStore = new UndoStore();
