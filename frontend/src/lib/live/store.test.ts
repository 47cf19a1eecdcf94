import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../api/client";
import { SETTLE_MS } from "./socket";
import {
  ageTenths,
  isAlive,
  LiveStore,
  LOST_AFTER_MS,
  OPEN_TIMEOUT_MS,
  STOP_ANSWER_TIMEOUT_MS,
} from "./store";

class FakeSocket {
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: (() => void) | null = null;
  onerror: (() => void) | null = null;
  closed = false;
  readyState = WebSocket.OPEN;
  sent: string[] = [];
  send(text: string) {
    this.sent.push(text);
  }
  close() {
    this.closed = true;
  }
  receive(message: object) {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

const live = { device: "running", age_ms: 5, mode: "idle", estop: "closed", torque: "off" } as Live;
const snapshot = (sequence = 1) => ({
  kind: "snapshot",
  sequence,
  station: { name: "Station 1" },
  live,
});
const change = (sequence: number, part: Partial<Live>) => ({ kind: "change", sequence, live: part });

let sockets: FakeSocket[];
let store: LiveStore;
let disconnect: () => void;

const socket = () => {
  const latest = sockets.at(-1);
  if (!latest) throw new Error("no socket yet");
  return latest;
};

beforeEach(() => {
  vi.useFakeTimers();
  sockets = [];
  store = new LiveStore(() => {
    sockets.push(new FakeSocket());
    return socket() as unknown as WebSocket;
  });
  disconnect = store.start();
});

afterEach(() => {
  disconnect();
  vi.useRealTimers();
});

describe("the live store", () => {
  it("is neither connected nor alive before the snapshot", () => {
    expect(store.get().connected).toBe(false);
    expect(isAlive(store.get())).toBe(false);
  });

  it("merges changes into the snapshot", () => {
    socket().receive(snapshot());
    const before = store.get().live;
    socket().receive(change(2, { mode: "playing" }));
    expect(store.get().live).toEqual({ ...before, mode: "playing" });
    expect(isAlive(store.get())).toBe(true);
  });

  it("confirms the states that it has shown, at most four times a second", () => {
    const confirmed = () => socket().sent.map((text) => JSON.parse(text).sequence);
    socket().receive(snapshot());
    expect(socket().sent).toEqual(['{"kind":"shown","sequence":1}']);
    for (let n = 2; n <= 8; n++) {
      vi.advanceTimersByTime(100);
      socket().receive(change(n, {}));
    }
    expect(confirmed()).toEqual([1, 4, 7]);
  });

  it("confirms no state that a listener could not show", () => {
    socket().receive(snapshot());
    vi.advanceTimersByTime(300);
    const unsubscribe = store.subscribe(() => {
      throw new Error("the page cannot draw");
    });
    expect(() => socket().receive(change(2, {}))).toThrow();
    unsubscribe();
    expect(socket().sent).toHaveLength(1);
  });

  it("confirms states although the computer's clock is set back", () => {
    socket().receive(snapshot());
    vi.advanceTimersByTime(300);
    vi.setSystemTime(Date.now() - 3_600_000);
    socket().receive(change(2, {}));
    expect(socket().sent).toHaveLength(2);
  });

  it("reconnects when a sequence number is missing", () => {
    socket().receive(snapshot());
    const first = socket();
    first.receive(change(3, { mode: "playing" }));
    expect(first.closed).toBe(true);
    expect(store.get().live?.mode).toBe("idle");
    vi.advanceTimersByTime(300);
    expect(sockets).toHaveLength(2);
    socket().receive(snapshot());
    expect(store.get().connected).toBe(true);
  });

  it("detects silence within two seconds on an open socket", () => {
    socket().receive(snapshot());
    vi.advanceTimersByTime(LOST_AFTER_MS - 100);
    expect(store.get().connected).toBe(true);
    vi.advanceTimersByTime(2000 - LOST_AFTER_MS + 100);
    expect(store.get().connected).toBe(false);
    expect(isAlive(store.get())).toBe(false);
  });

  it("is not alive without the device process", () => {
    socket().receive(snapshot());
    socket().receive(change(2, { age_ms: LOST_AFTER_MS }));
    expect(store.get().connected).toBe(true);
    expect(isAlive(store.get())).toBe(false);
    socket().receive(change(3, { age_ms: 5, device: "restarting" }));
    expect(isAlive(store.get())).toBe(false);
  });

  it("reconnects with growing pauses", () => {
    for (const pause of [250, 500, 1000, 1000, 1000]) {
      const attempts = sockets.length;
      socket().onclose?.();
      vi.advanceTimersByTime(pause - 1);
      expect(sockets).toHaveLength(attempts);
      vi.advanceTimersByTime(1);
      expect(sockets).toHaveLength(attempts + 1);
    }
  });

  it("ignores messages of an old socket", () => {
    socket().receive(snapshot());
    const oldSocket = socket();
    const stale = oldSocket.onmessage;
    oldSocket.onclose?.();
    stale?.({ data: JSON.stringify(change(2, { mode: "playing" })) });
    expect(store.get().live?.mode).toBe("idle");
  });

  it("reports a connection that has returned, but not the first one", () => {
    const onReconnected = vi.fn();
    store.onReconnected(onReconnected);
    socket().receive(snapshot());
    socket().onclose?.();
    vi.advanceTimersByTime(1000);
    expect(sockets).toHaveLength(2);
    expect(onReconnected).not.toHaveBeenCalled();
    socket().receive(snapshot());
    expect(onReconnected).toHaveBeenCalledTimes(1);
  });

  it("reports saved records and collects events", () => {
    const saved: string[] = [];
    store.onSaved((message) => saved.push(message.id));
    socket().receive(snapshot());
    socket().receive({ kind: "saved", sequence: 2, what: "run", id: "r1" });
    socket().receive({ kind: "event", sequence: 3, event: { number: 1, code: "mode", message: "idle" } });
    expect(saved).toEqual(["r1"]);
    expect(store.get().events.map((event) => event.code)).toEqual(["mode"]);
  });

  it("detects delayed messages despite a wrong service clock", () => {
    // The service's clock is one hour behind.
    const sent_at = (lateMs: number) => new Date(Date.now() - 3_600_000 - lateMs).toISOString();
    socket().receive({ ...snapshot(), sent_at: sent_at(0) });
    expect(isAlive(store.get())).toBe(true);
    socket().receive({ ...change(2, { mode: "playing" }), sent_at: sent_at(LOST_AFTER_MS + 1) });
    expect(isAlive(store.get())).toBe(false);
    expect(ageTenths(store.get(), Date.now())).toBe(12);
    socket().receive({ ...change(3, {}), sent_at: sent_at(20) });
    expect(isAlive(store.get())).toBe(true);
  });

  describe("after the page was blocked", () => {
    const sent = (message: object, at: number) => ({ ...message, sent_at: new Date(at).toISOString() });
    /** Block the page, for example by drawing. Messages wait meanwhile. */
    const block = (ms: number) => vi.setSystemTime(Date.now() + ms);

    beforeEach(() => {
      socket().receive(sent(snapshot(), Date.now()));
      vi.advanceTimersByTime(500);
    });

    it("processes waiting messages before judging the connection", () => {
      const before = Date.now();
      const onConnected = vi.fn();
      block(3000);
      store.subscribe(() => onConnected(store.get().connected));
      for (let n = 2; n < 30; n++) socket().receive(sent(change(n, {}), before + 100 * n));
      vi.advanceTimersByTime(SETTLE_MS);
      socket().receive(sent(change(30, {}), Date.now()));
      vi.advanceTimersByTime(LOST_AFTER_MS - SETTLE_MS);
      expect(onConnected).not.toHaveBeenCalledWith(false);
      expect(sockets).toHaveLength(1);
    });

    it.each([
      ["nothing waited", 0],
      ["what waited is old", 10],
    ])("detects a connection lost meanwhile: %s", (_, messages) => {
      const before = Date.now();
      block(3000);
      for (let n = 2; n < 2 + messages; n++) socket().receive(sent(change(n, {}), before + n));
      vi.advanceTimersByTime(500);
      expect(store.get().connected).toBe(false);
    });
  });

  it("tolerates drifting clocks", () => {
    const startedAt = Date.now();
    socket().receive({ ...snapshot(), sent_at: new Date(startedAt).toISOString() });
    // The service's clock loses three seconds per hour.
    for (let n = 2; n < 3600; n++) {
      vi.advanceTimersByTime(1000);
      const passed = Date.now() - startedAt;
      socket().receive({
        ...change(n, {}),
        sent_at: new Date(startedAt + passed * (1 - 3 / 3600)).toISOString(),
      });
      expect(store.get().connected).toBe(true);
    }
  });

  it("retries a connection that does not open in time", () => {
    vi.advanceTimersByTime(OPEN_TIMEOUT_MS + 500);
    expect(sockets[0]?.closed).toBe(true);
    vi.advanceTimersByTime(250);
    expect(sockets).toHaveLength(2);
  });

  it("sends Stop over the connection and returns the answer", async () => {
    socket().receive(snapshot());
    const stopAnswer = store.stop();
    expect(socket().sent.slice(-1)).toEqual(['{"kind":"stop","number":1}']);
    const answer = { kind: "stop_answer", sequence: 2, number: 1, refusal: null };
    socket().receive(answer);
    expect(await stopAnswer).toEqual(answer);
  });

  it.each([
    ["nobody is connected", () => {}, () => {}],
    [
      "no answer comes in time",
      () => socket().receive(snapshot()),
      () => vi.advanceTimersByTime(STOP_ANSWER_TIMEOUT_MS),
    ],
    ["the connection ends", () => socket().receive(snapshot()), () => socket().onclose?.()],
  ])("reports that Stop needs another way when %s", async (_, before, after) => {
    before();
    const stopAnswer = store.stop();
    after();
    expect(await stopAnswer).toBeNull();
  });

  it("resolves when the state is newer or the connection lost", async () => {
    await store.waitForFreshState();
    socket().receive(snapshot());
    let fresh = false;
    const waiting = store.waitForFreshState().then(() => {
      fresh = true;
    });
    socket().receive(change(2, {}));
    await Promise.resolve();
    expect(fresh).toBe(false);
    socket().receive(change(3, {}));
    await waiting;
    const afterLoss = store.waitForFreshState();
    vi.advanceTimersByTime(LOST_AFTER_MS + 500);
    await afterLoss;
  });
});
