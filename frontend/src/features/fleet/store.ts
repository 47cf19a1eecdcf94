import type { Schemas } from "../../lib/api/client";
import { openSocket } from "../../lib/live/socket";
import type { Shown } from "./messages";

/** The service sends at least one message per second. */
export const LOST_AFTER_MS = 2500;
const LOOK_EVERY_MS = 250;
const AGAIN_MS = 1000;
/**
 * A silent connection is replaced after this time, because a browser with an unplugged cable would wait for
 * minutes.
 */
export const OPEN_WITHIN_MS = 3000;

/** Data of the stations. `stations` is null before the first message and after a lost connection. */
export interface Known {
  stations: Shown[] | null;
  /** True if messages were received before. */
  lost: boolean;
}

/** The WebSocket with all stations, open while the page is shown. */
export class StationsStore {
  #known: Known = { stations: null, lost: false };
  #listeners = new Set<() => void>();
  #socket: WebSocket | null = null;
  #heardAt = 0;
  #triedAt = 0;
  #again: ReturnType<typeof setTimeout> | null = null;
  #looking: ReturnType<typeof setInterval> | null = null;
  #connect: () => WebSocket;

  constructor(connect: () => WebSocket) {
    this.#connect = connect;
  }

  subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    if (this.#listeners.size === 1) this.#start();
    return () => {
      this.#listeners.delete(listener);
      if (this.#listeners.size === 0) this.#end();
    };
  };

  get = (): Known => this.#known;

  #start() {
    this.#open();
    this.#looking = setInterval(() => {
      const now = Date.now();
      const silent = this.#known.stations
        ? now - this.#heardAt > LOST_AFTER_MS
        : now - this.#triedAt > OPEN_WITHIN_MS;
      if (this.#socket && silent) this.#lose();
    }, LOOK_EVERY_MS);
  }

  #end() {
    if (this.#looking) clearInterval(this.#looking);
    if (this.#again) clearTimeout(this.#again);
    this.#drop();
    this.#known = { stations: null, lost: false };
  }

  #open() {
    const socket = this.#connect();
    this.#socket = socket;
    this.#triedAt = Date.now();
    socket.onmessage = (event) => {
      if (socket !== this.#socket) return;
      this.#heardAt = Date.now();
      const message = JSON.parse(String(event.data)) as Schemas["StationsMessage"];
      this.#set({ stations: message.stations, lost: false });
    };
    socket.onclose = () => socket === this.#socket && this.#lose();
  }

  #lose() {
    this.#drop();
    this.#set({ stations: null, lost: this.#known.lost || this.#known.stations !== null });
    this.#again = setTimeout(() => this.#open(), AGAIN_MS);
  }

  #drop() {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  #set(known: Known) {
    this.#known = known;
    for (const listener of this.#listeners) listener();
  }
}

export const stations = new StationsStore(() => openSocket("/api/stations/live"));
