import type { Live, Schemas, StationInfo } from "../api/client";
import { openSocket, ReconnectingSocket } from "./socket";

type LiveMessage =
  | Schemas["SnapshotMessage"]
  | Schemas["ChangeMessage"]
  | Schemas["EventMessage"]
  | Schemas["SavedMessage"]
  | Schemas["StopAnswerMessage"];

/** If no message arrives for this time, the connection counts as lost. The service sends at least five per second. */
export const LOST_AFTER_MS = 1200;
/**
 * Delays before the first, second and third attempt to reconnect; the third one repeats. An attempt that hangs ends
 * after OPEN_TIMEOUT_MS, so the page is connected at most three seconds after the service returns. Keep every delay
 * below PAUSE_AFTER_ABSENCE_S of station/lease.py: a longer one lets a short interruption pause the playback.
 */
const RECONNECT_DELAYS_MS = [250, 500, 1000] as const;
export const OPEN_TIMEOUT_MS = 2000;
/** If the live connection does not answer a Stop within this time, the page sends it by a separate request. */
export const STOP_ANSWER_TIMEOUT_MS = 600;
/**
 * The page confirms so often that it has shown a state. The lease depends on it: a browser answers the service's
 * pings itself, even if the page's script hangs. The messages of a hidden page are not throttled, its timers are.
 */
const CONFIRM_EVERY_MS = 250;
/** Allowed drift between the two clocks. Delays of a congested connection grow faster than this. */
const CLOCK_DRIFT = 0.001;
const MAX_EVENTS = 50;

/** The page's knowledge of the station. Each change replaces the object; it is never modified. */
export interface LiveState {
  /** True while messages arrive. Otherwise the fields below are outdated. */
  connected: boolean;
  /** Time at which the last message was sent, by this computer's clock. */
  heardAt: number | null;
  station: StationInfo | null;
  live: Live | null;
  events: Schemas["EventLive"][];
}

const EMPTY: LiveState = { connected: false, heardAt: null, station: null, live: null, events: [] };

/**
 * The WebSocket to the service. It receives a snapshot, then changes. A missing sequence number causes a new
 * connection.
 */
export class LiveStore {
  #state: LiveState = EMPTY;
  #listeners = new Set<() => void>();
  #savedListeners = new Set<(saved: Schemas["SavedMessage"]) => void>();
  #reconnectedListeners = new Set<() => void>();
  #lostListeners = new Set<() => void>();
  #pendingStops = new Map<number, (answer: Schemas["StopAnswerMessage"] | null) => void>();
  #stopNumber = 0;
  #socket: ReconnectingSocket;
  #sequence = 0;
  /** When a shown state was last confirmed, by the monotonic clock. */
  #confirmedAt = Number.NEGATIVE_INFINITY;
  /**
   * The shortest transport time of this connection, measured with unsynchronized clocks, and the time of that
   * measurement.
   */
  #fastest: { ms: number; at: number } | null = null;

  constructor(connect: () => WebSocket) {
    this.#socket = new ReconnectingSocket({
      connect,
      lostAfterMs: LOST_AFTER_MS,
      openTimeoutMs: OPEN_TIMEOUT_MS,
      reconnectDelaysMs: RECONNECT_DELAYS_MS,
      bridgesReconnect: true,
      onOpen: () => this.#reset(),
      onMessage: (text) => this.#receive(JSON.parse(text) as LiveMessage),
      onDisconnected: () => this.#set({ ...this.#state, connected: false }),
      onClosed: () => {
        this.#abandonStops();
        for (const listener of this.#lostListeners) listener();
      },
    });
  }

  /** Connect and stay connected. The returned function disconnects and clears the state. */
  start(): () => void {
    this.#socket.start();
    return () => {
      this.#socket.stop();
      this.#abandonStops();
      this.#set(EMPTY);
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

  /** Register a listener for a connection that has returned: messages may have been missed. */
  onReconnected(listener: () => void): () => void {
    this.#reconnectedListeners.add(listener);
    return () => {
      this.#reconnectedListeners.delete(listener);
    };
  }

  /** Register a listener for a refused or ended connection, called before the next attempt. */
  onLost(listener: () => void): () => void {
    this.#lostListeners.add(listener);
    return () => this.#lostListeners.delete(listener);
  }

  get = (): LiveState => this.#state;

  /**
   * Send Stop over the open connection. Return the device's answer, or null if none came in time, so that
   * another way is needed.
   */
  stop(): Promise<Schemas["StopAnswerMessage"] | null> {
    if (!this.#state.connected) return Promise.resolve(null);
    this.#stopNumber += 1;
    const request: Schemas["StopMessage"] = { kind: "stop", number: this.#stopNumber };
    if (!this.#socket.send(request)) return Promise.resolve(null);
    return new Promise((resolve) => {
      const settle = (answer: Schemas["StopAnswerMessage"] | null) => {
        clearTimeout(timeout);
        this.#pendingStops.delete(request.number);
        resolve(answer);
      };
      const timeout = setTimeout(() => settle(null), STOP_ANSWER_TIMEOUT_MS);
      this.#pendingStops.set(request.number, settle);
    });
  }

  /**
   * Return the state that this page shows. Commands that start motion, release an arm or reset a stop must
   * contain it.
   */
  seen(): Schemas["SeenState"] {
    const live = this.#state.live;
    return { stops: live?.stops ?? 0, seen_at: live?.at ?? new Date(0).toISOString() };
  }

  /** Wait until the shown state is newer than the service's last answer, or the connection is lost. */
  waitForFreshState(): Promise<void> {
    // The first message may have been sent before the service's answer.
    let remaining = 2;
    return new Promise((resolve) => {
      const onChange = () => {
        if (--remaining > 0 && this.#state.connected) return;
        unsubscribe();
        resolve();
      };
      const unsubscribe = this.subscribe(onChange);
      if (!this.#state.connected) {
        unsubscribe();
        resolve();
      }
    });
  }

  /** Expect the first message of a new connection. */
  #reset() {
    this.#sequence = 0;
    this.#confirmedAt = Number.NEGATIVE_INFINITY;
    this.#fastest = null;
  }

  #receive(message: LiveMessage) {
    if (message.sequence !== this.#sequence + 1) {
      this.#socket.reconnect();
      return;
    }
    this.#sequence = message.sequence;
    const heardAt = this.#sentAt(message);
    const connected = this.#socket.heard(heardAt);
    const next: LiveState = { ...this.#state, connected, heardAt };
    switch (message.kind) {
      case "snapshot":
        if (this.#state.live) for (const listener of this.#reconnectedListeners) listener();
        next.station = message.station;
        next.live = message.live;
        break;
      case "change":
        next.live = { ...(this.#state.live as Live), ...message.live };
        break;
      case "event":
        next.events = [message.event, ...this.#state.events].slice(0, MAX_EVENTS);
        break;
      case "saved":
        for (const listener of this.#savedListeners) listener(message);
        break;
      case "stop_answer":
        this.#pendingStops.get(message.number)?.(message);
        break;
    }
    this.#set(next);
    this.#confirm(message.sequence);
  }

  /** Tell the service that the page has shown this message. An error of a listener before it prevents that. */
  #confirm(sequence: number) {
    const now = performance.now();
    if (now - this.#confirmedAt < CONFIRM_EVERY_MS) return;
    const shown: Schemas["ShownMessage"] = { kind: "shown", sequence };
    if (this.#socket.send(shown)) this.#confirmedAt = now;
  }

  /**
   * Return when a message was sent, by this computer's clock. The service's clock may be wrong by hours, so the
   * delay is measured relative to the fastest message of this connection. A message that waited in the network
   * or in a blocked page is old.
   */
  #sentAt(message: LiveMessage): number {
    const now = Date.now();
    const delay = now - Date.parse(message.sent_at);
    if (Number.isNaN(delay)) return now;
    const fastest = this.#fastest;
    const minDelay = fastest ? Math.min(delay, fastest.ms + CLOCK_DRIFT * (now - fastest.at)) : delay;
    this.#fastest = { ms: minDelay, at: now };
    return now - (delay - minDelay);
  }

  /** Report to every waiting Stop that it needs another way. */
  #abandonStops() {
    for (const settle of [...this.#pendingStops.values()]) settle(null);
  }

  #set(next: LiveState) {
    this.#state = next;
    for (const listener of this.#listeners) listener();
  }
}

/** Return true if messages arrive and the device process is running with current data. */
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

/** Return the age of the shown state in tenths of a second, or null without data. */
export function ageTenths({ heardAt, live }: LiveState, now: number): number | null {
  if (heardAt === null || live?.age_ms == null) return null;
  return Math.round((Math.max(0, now - heardAt) + live.age_ms) / 100);
}

export const store = new LiveStore(() => openSocket("/api/live"));
