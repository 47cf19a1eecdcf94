import type { Live, Schemas, StationInfo } from "../api/client";
import { socketTo } from "./socket";

export type LiveMessage =
  | Schemas["SnapshotMessage"]
  | Schemas["ChangeMessage"]
  | Schemas["EventMessage"]
  | Schemas["SavedMessage"]
  | Schemas["StopAnswerMessage"];

/** A last message this old counts as a lost connection; the service speaks ten times a second. */
export const LOST_AFTER_MS = 1200;
const LOOK_EVERY_MS = 250;
/** After a pause of its own the page first hears what waited for it meanwhile, for this long, and then judges. */
export const SETTLE_MS = 100;
/** So that the page is right again within three seconds of the service's return. */
const RECONNECT_MS = [250, 500, 1000, 1000];
/** A connection that is not made by then is tried anew: where a cable was pulled, the browser itself would wait for minutes. */
export const OPEN_WITHIN_MS = 2000;
/** Stop goes another way when it is not answered over the live connection by then. */
export const STOP_ANSWER_MS = 600;
/** Two clocks drift apart; a connection over which everything comes later and later does so faster than this. */
const DRIFT = 0.001;
const EVENTS_KEPT = 50;

/** What the page knows of the station at this moment. Replaced whole at every change, never altered. */
export interface LiveState {
  /** Messages are coming. Without them nothing below is to be believed. */
  connected: boolean;
  /** When the last message was sent, by this computer's clock. */
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
  #stops = new Map<number, (answer: Schemas["StopAnswerMessage"] | null) => void>();
  #stopNumber = 0;
  #socket: WebSocket | null = null;
  #triedAt = 0;
  #lookedAt = 0;
  #settlesAt = 0;
  #sequence = 0;
  /** Of this connection: the least that a message took, by two clocks that know nothing of each other, and when that was. */
  #quickest: { ms: number; at: number } | null = null;
  #failures = 0;
  #reconnecting: ReturnType<typeof setTimeout> | null = null;
  #connect: () => WebSocket;

  constructor(connect: () => WebSocket) {
    this.#connect = connect;
  }

  /** Connect, and keep connected. Returns how to end it; then everything that was heard is forgotten. */
  start(): () => void {
    this.#open();
    this.#lookedAt = Date.now();
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

  /**
   * Ask for Stop over the connection that is open already. What the device said to it; null when nothing was heard in time,
   * and another way has to be taken.
   */
  stop(): Promise<Schemas["StopAnswerMessage"] | null> {
    const socket = this.#socket;
    if (!socket || !this.#state.connected || socket.readyState !== WebSocket.OPEN)
      return Promise.resolve(null);
    this.#stopNumber += 1;
    const asked: Schemas["StopMessage"] = { kind: "stop", number: this.#stopNumber };
    return new Promise((resolve) => {
      const answered = (answer: Schemas["StopAnswerMessage"] | null) => {
        clearTimeout(waiting);
        this.#stops.delete(asked.number);
        resolve(answer);
      };
      const waiting = setTimeout(() => answered(null), STOP_ANSWER_MS);
      this.#stops.set(asked.number, answered);
      socket.send(JSON.stringify(asked));
    });
  }

  /** What a command that can start motion, release an arm or reset a stop has to carry: the state that this page shows. */
  seen(): Schemas["SeenState"] {
    const live = this.#state.live;
    return { stops: live?.stops ?? 0, seen_at: live?.at ?? new Date(0).toISOString() };
  }

  /** Until what is shown is newer than what the service has just answered, or nobody tells any more. */
  told(): Promise<void> {
    // The first message may have been on its way already.
    let missing = 2;
    return new Promise((resolve) => {
      const look = () => {
        if (--missing > 0 && this.#state.connected) return;
        leave();
        resolve();
      };
      const leave = this.subscribe(look);
      if (!this.#state.connected) {
        leave();
        resolve();
      }
    });
  }

  #open() {
    const socket = this.#connect();
    this.#socket = socket;
    this.#triedAt = Date.now();
    this.#sequence = 0;
    this.#quickest = null;
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
    const heardAt = this.#sentAt(message);
    const now = Date.now();
    const connected = now - heardAt <= LOST_AFTER_MS || (this.#state.connected && this.#settles(now));
    const next: LiveState = { ...this.#state, connected, heardAt };
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
      case "stop_answer":
        this.#stops.get(message.number)?.(message);
        break;
    }
    this.#set(next);
  }

  /**
   * When a message was sent, by this computer's clock. The service's clock may be wrong by hours: what counts is how much longer a
   * message took than the quickest one of this connection. What waited in a network, or in a page that slept, is old when it comes.
   */
  #sentAt(message: LiveMessage): number {
    const now = Date.now();
    const took = now - Date.parse(message.sent_at);
    if (Number.isNaN(took)) return now;
    const before = this.#quickest;
    const least = before ? Math.min(took, before.ms + DRIFT * (now - before.at)) : took;
    this.#quickest = { ms: least, at: now };
    return now - (took - least);
  }

  /**
   * Whether the page itself has just stood still, drawing figures or put to sleep: what it hears now has waited here, not on its way,
   * and says nothing of the connection.
   */
  #settles(now: number): boolean {
    if (now - this.#lookedAt > LOST_AFTER_MS) {
      this.#lookedAt = now;
      this.#settlesAt = now + SETTLE_MS;
      setTimeout(() => this.#judge(), SETTLE_MS);
    }
    return now < this.#settlesAt;
  }

  #look() {
    const now = Date.now();
    if (this.#settles(now)) return;
    this.#lookedAt = now;
    this.#judge();
  }

  /** Silence is noticed by looking: a cable that is pulled closes no socket. */
  #judge() {
    const { connected, heardAt } = this.#state;
    const now = Date.now();
    if (heardAt !== null && now - heardAt > LOST_AFTER_MS && connected) {
      this.#set({ ...this.#state, connected: false });
      if (this.#socket) this.#again(this.#socket);
    } else if (!connected && this.#socket && now - this.#triedAt > OPEN_WITHIN_MS) {
      this.#again(this.#socket);
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
    for (const answered of [...this.#stops.values()]) answered(null);
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

/** How old the shown state is, in tenths of a second; null before anything has come. */
export function ageTenths({ heardAt, live }: LiveState, now: number): number | null {
  if (heardAt === null || live?.age_ms == null) return null;
  return Math.round((Math.max(0, now - heardAt) + live.age_ms) / 100);
}

export const store = new LiveStore(() => socketTo("/api/live"));
