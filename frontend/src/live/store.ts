import type { Live, Schemas, StationInfo } from "../api/client";

export type LiveMessage =
  | Schemas["SnapshotMessage"]
  | Schemas["ChangeMessage"]
  | Schemas["EventMessage"]
  | Schemas["SavedMessage"];

/** Silence for this long counts as a lost connection; the service speaks ten times a second. */
export const LOST_AFTER_MS = 1200;
const LOOK_EVERY_MS = 250;
const RECONNECT_MS = [250, 500, 1000, 2000];
const EVENTS_KEPT = 50;

/** What the page knows of the station at this moment. Replaced whole at every change, never altered. */
export interface LiveState {
  /** Messages are coming. Without them nothing below is to be believed. */
  connected: boolean;
  /** Of the last message, by this computer's clock. */
  heardAt: number | null;
  station: StationInfo | null;
  live: Live | null;
  events: Schemas["EventLive"][];
}

const NOTHING: LiveState = { connected: false, heardAt: null, station: null, live: null, events: [] };

/** The one WebSocket to the service: snapshot first, then changes; a gap in the numbers means beginning anew. */
export class LiveStore {
  #state: LiveState = NOTHING;
  #listeners = new Set<() => void>();
  #savedListeners = new Set<(saved: Schemas["SavedMessage"]) => void>();
  #lostListeners = new Set<() => void>();
  #socket: WebSocket | null = null;
  #sequence = 0;
  #failures = 0;
  #reconnecting: ReturnType<typeof setTimeout> | null = null;
  #connect: () => WebSocket;

  constructor(connect: () => WebSocket) {
    this.#connect = connect;
  }

  /** Connect, and keep connected. Returns how to end it; then everything that was heard is forgotten. */
  start(): () => void {
    this.#open();
    const looking = setInterval(() => this.#look(), LOOK_EVERY_MS);
    return () => {
      clearInterval(looking);
      if (this.#reconnecting) clearTimeout(this.#reconnecting);
      this.#drop();
      this.#failures = 0;
      this.#set(NOTHING);
    };
  }

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => {
      this.#listeners.delete(listener);
    };
  };

  onSaved(listener: (saved: Schemas["SavedMessage"]) => void): () => void {
    this.#savedListeners.add(listener);
    return () => {
      this.#savedListeners.delete(listener);
    };
  }

  /** Called when a connection was refused or has ended, before it is tried again. */
  onLost(listener: () => void): () => void {
    this.#lostListeners.add(listener);
    return () => this.#lostListeners.delete(listener);
  }

  get = (): LiveState => this.#state;

  #open() {
    const socket = this.#connect();
    this.#socket = socket;
    this.#sequence = 0;
    socket.onmessage = (event) => this.#take(socket, JSON.parse(String(event.data)) as LiveMessage);
    socket.onclose = () => this.#again(socket);
    socket.onerror = () => this.#again(socket);
  }

  #take(socket: WebSocket, message: LiveMessage) {
    if (socket !== this.#socket) return;
    if (message.sequence !== this.#sequence + 1) {
      this.#again(socket);
      return;
    }
    this.#sequence = message.sequence;
    this.#failures = 0;
    const next: LiveState = { ...this.#state, connected: true, heardAt: Date.now() };
    switch (message.kind) {
      case "snapshot":
        next.station = message.station;
        next.live = message.live;
        break;
      case "change":
        next.live = { ...(this.#state.live as Live), ...message.live };
        break;
      case "event":
        next.events = [message.event, ...this.#state.events].slice(0, EVENTS_KEPT);
        break;
      case "saved":
        for (const listener of this.#savedListeners) listener(message);
        break;
    }
    this.#set(next);
  }

  /** Silence is noticed by looking: a cable that is pulled closes no socket. */
  #look() {
    const { connected, heardAt } = this.#state;
    if (connected && heardAt !== null && Date.now() - heardAt > LOST_AFTER_MS) {
      this.#set({ ...this.#state, connected: false });
      if (this.#socket) this.#again(this.#socket);
    }
  }

  #again(socket: WebSocket) {
    if (socket !== this.#socket) return;
    this.#drop();
    const pause = RECONNECT_MS[Math.min(this.#failures, RECONNECT_MS.length - 1)];
    this.#failures += 1;
    this.#reconnecting = setTimeout(() => this.#open(), pause);
    for (const listener of this.#lostListeners) listener();
  }

  #drop() {
    const socket = this.#socket;
    this.#socket = null;
    if (socket) {
      socket.onmessage = null;
      socket.onclose = null;
      socket.onerror = null;
      socket.close();
    }
  }

  #set(next: LiveState) {
    this.#state = next;
    for (const listener of this.#listeners) listener();
  }
}

/** The station's data is fresh: messages come, and the device process behind them is alive. */
export function isAlive(state: LiveState): boolean {
  const live = state.live;
  return (
    state.connected &&
    live !== null &&
    live.device === "running" &&
    live.age_ms !== null &&
    live.age_ms < LOST_AFTER_MS
  );
}

export const store = new LiveStore(() => {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}/api/live`);
});
