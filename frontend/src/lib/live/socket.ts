/** Open a WebSocket to the page's own service. */
export function openSocket(path: string): WebSocket {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}${path}`);
}

const CHECK_EVERY_MS = 250;
/** After the page was blocked, it processes waiting messages for this time before it judges the connection. */
export const SETTLE_MS = 100;

interface SocketOptions {
  connect: () => WebSocket;
  /** If no message arrives for this time, the connection counts as lost. */
  lostAfterMs: number;
  /**
   * An attempt that does not succeed within this time is repeated, because a browser with an unplugged cable
   * would wait for minutes.
   */
  openTimeoutMs: number;
  /** Delays before the first, second, ... attempt to reconnect. The last one repeats. */
  reconnectDelaysMs: readonly [number, ...number[]];
  /** True: a closed socket leaves `connected` true until `lostAfterMs` pass without a message. */
  bridgesReconnect: boolean;
  /** Called before the first message of every new socket. */
  onOpen?: () => void;
  onMessage: (text: string) => void;
  /** Called when `connected` becomes false without a message. */
  onDisconnected: () => void;
  /** Called for each refused or ended connection, before the next attempt. */
  onClosed?: () => void;
}

/** A WebSocket that detects silence and connects again. */
export class ReconnectingSocket {
  #options: SocketOptions;
  #socket: WebSocket | null = null;
  #connected = false;
  #heardAt = 0;
  #openedAt = 0;
  #checkedAt = 0;
  #settledAt = 0;
  #failures = 0;
  #reconnectTimer: ReturnType<typeof setTimeout> | null = null;
  #checkTimer: ReturnType<typeof setInterval> | null = null;

  constructor(options: SocketOptions) {
    this.#options = options;
  }

  /** Connect and stay connected. */
  start() {
    this.#open();
    this.#checkedAt = Date.now();
    this.#checkTimer = setInterval(() => this.#check(), CHECK_EVERY_MS);
  }

  stop() {
    if (this.#checkTimer) clearInterval(this.#checkTimer);
    if (this.#reconnectTimer) clearTimeout(this.#reconnectTimer);
    this.#close();
    this.#failures = 0;
    this.#connected = false;
  }

  /** Send a message. Return false if the socket is not open. */
  send(message: object): boolean {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Accept a message that was sent at this time. Return true if the connection is current. */
  heard(sentAt: number): boolean {
    const now = Date.now();
    this.#failures = 0;
    this.#heardAt = sentAt;
    this.#connected = now - sentAt <= this.#options.lostAfterMs || (this.#connected && this.#isSettling(now));
    return this.#connected;
  }

  /** Close the socket and open a new one after a delay. */
  reconnect() {
    this.#close();
    const { bridgesReconnect, onClosed, onDisconnected, reconnectDelaysMs } = this.#options;
    const delay = reconnectDelaysMs[Math.min(this.#failures, reconnectDelaysMs.length - 1)];
    this.#failures += 1;
    this.#reconnectTimer = setTimeout(() => this.#open(), delay);
    if (this.#connected && !bridgesReconnect) {
      this.#connected = false;
      onDisconnected();
    }
    onClosed?.();
  }

  #open() {
    const socket = this.#options.connect();
    this.#socket = socket;
    this.#openedAt = Date.now();
    this.#options.onOpen?.();
    const isCurrent = () => socket === this.#socket;
    socket.onmessage = (event) => isCurrent() && this.#options.onMessage(String(event.data));
    socket.onclose = () => isCurrent() && this.reconnect();
    socket.onerror = () => isCurrent() && this.reconnect();
  }

  #close() {
    const socket = this.#socket;
    this.#socket = null;
    if (socket) {
      socket.onmessage = null;
      socket.onclose = null;
      socket.onerror = null;
      socket.close();
    }
  }

  /**
   * Return true shortly after the page was blocked by drawing, sleep or the throttled timers of a hidden page.
   * Messages then waited in the page, so their age does not mean that the connection is lost.
   */
  #isSettling(now: number): boolean {
    if (now - this.#checkedAt > this.#options.lostAfterMs) {
      this.#checkedAt = now;
      this.#settledAt = now + SETTLE_MS;
      setTimeout(() => this.#checkConnection(), SETTLE_MS);
    }
    return now < this.#settledAt;
  }

  #check() {
    const now = Date.now();
    if (this.#isSettling(now)) return;
    this.#checkedAt = now;
    this.#checkConnection();
  }

  /** Detect a lost connection by polling, because an unplugged cable does not close the socket. */
  #checkConnection() {
    const { lostAfterMs, onDisconnected, openTimeoutMs } = this.#options;
    const now = Date.now();
    const silent = this.#connected && now - this.#heardAt > lostAfterMs;
    const unopened = !this.#connected && now - this.#openedAt > openTimeoutMs;
    if (silent) {
      this.#connected = false;
      onDisconnected();
    }
    if (this.#socket && (silent || unopened)) this.reconnect();
  }
}
