/** An action that was just done, and how to take it back. */
export type Undoable = { words: string; undo: () => Promise<unknown> };

/** Long enough to read it and to reach the button with the tab key. */
const OFFERED_MS = 20_000;

/** Holds the last action that can be taken back. One at a time, for a while. */
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

  /** Offer to take an action back. It replaces the offer before. */
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
