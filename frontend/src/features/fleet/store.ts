import type { Schemas } from "../../lib/api/client";
import { openSocket, ReconnectingSocket } from "../../lib/live/socket";
import type { Shown } from "./messages";

/** The service sends at least one message per second. */
export const STATIONS_LOST_AFTER_MS = 2500;
/** Delays before each attempt to reconnect. */
const STATIONS_RECONNECT_DELAYS_MS = [1000] as const;
const STATIONS_OPEN_TIMEOUT_MS = 3000;

/** Data of the stations. `stations` is null before the first message and after a lost connection. */
interface Known {
  stations: Shown[] | null;
  /** True if messages were received before. */
  lost: boolean;
}

/** The WebSocket with all stations, open while the page is shown. */
export class StationsStore {
  #known: Known = { stations: null, lost: false };
  #listeners = new Set<() => void>();
  #socket: ReconnectingSocket;

  constructor(connect: () => WebSocket) {
    this.#socket = new ReconnectingSocket({
      connect,
      lostAfterMs: STATIONS_LOST_AFTER_MS,
      openTimeoutMs: STATIONS_OPEN_TIMEOUT_MS,
      reconnectDelaysMs: STATIONS_RECONNECT_DELAYS_MS,
      bridgesReconnect: false,
      onMessage: (text) => {
        this.#socket.heard(Date.now());
        const message = JSON.parse(text) as Schemas["StationsMessage"];
        this.#set({ stations: message.stations, lost: false });
      },
      onDisconnected: () => this.#set({ stations: null, lost: true }),
    });
  }

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    if (this.#listeners.size === 1) this.#socket.start();
    return () => {
      this.#listeners.delete(listener);
      if (this.#listeners.size === 0) this.#end();
    };
  };

  get = (): Known => this.#known;

  #end() {
    this.#socket.stop();
    this.#known = { stations: null, lost: false };
  }

  #set(known: Known) {
    this.#known = known;
    for (const listener of this.#listeners) listener();
  }
}

export const stations = new StationsStore(() => openSocket("/api/stations/live"));
