import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../api/client";
import {
  ageTenths,
  isAlive,
  LiveStore,
  LOST_AFTER_MS,
  OPEN_WITHIN_MS,
  SETTLE_MS,
  STOP_ANSWER_MS,
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
  say(message: object) {
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
let end: () => void;

const socket = () => {
  const last = sockets.at(-1);
  if (!last) throw new Error("no socket yet");
  return last;
};

beforeEach(() => {
  vi.useFakeTimers();
  sockets = [];
  store = new LiveStore(() => {
    sockets.push(new FakeSocket());
    return socket() as unknown as WebSocket;
  });
  end = store.start();
});

afterEach(() => {
  end();
  vi.useRealTimers();
});

describe("the live store", () => {
  it("is neither connected nor alive before the snapshot", () => {
    expect(store.get().connected).toBe(false);
    expect(isAlive(store.get())).toBe(false);
  });

  it("merges changes into the snapshot and keeps what did not change as it was", () => {
    socket().say(snapshot());
    const before = store.get().live;
    socket().say(change(2, { mode: "playing" }));
    expect(store.get().live).toEqual({ ...before, mode: "playing" });
    expect(isAlive(store.get())).toBe(true);
  });

  it("begins anew when a number is missing, and believes nothing after the gap", () => {
    socket().say(snapshot());
    const first = socket();
    first.say(change(3, { mode: "playing" }));
    expect(first.closed).toBe(true);
    expect(store.get().live?.mode).toBe("idle");
    vi.advanceTimersByTime(300);
    expect(sockets).toHaveLength(2);
    socket().say(snapshot());
    expect(store.get().connected).toBe(true);
  });

  it("notices silence within two seconds, though no socket was closed", () => {
    socket().say(snapshot());
    vi.advanceTimersByTime(LOST_AFTER_MS - 100);
    expect(store.get().connected).toBe(true);
    vi.advanceTimersByTime(2000 - LOST_AFTER_MS + 100);
    expect(store.get().connected).toBe(false);
    expect(isAlive(store.get())).toBe(false);
  });

  it("is not alive while the device process is not, however many messages come", () => {
    socket().say(snapshot());
    socket().say(change(2, { age_ms: LOST_AFTER_MS }));
    expect(store.get().connected).toBe(true);
    expect(isAlive(store.get())).toBe(false);
    socket().say(change(3, { age_ms: 5, device: "restarting" }));
    expect(isAlive(store.get())).toBe(false);
  });

  it("tries again and again, a little slower each time", () => {
    for (const pause of [250, 500, 1000, 1000, 1000]) {
      const tries = sockets.length;
      socket().onclose?.();
      vi.advanceTimersByTime(pause - 1);
      expect(sockets).toHaveLength(tries);
      vi.advanceTimersByTime(1);
      expect(sockets).toHaveLength(tries + 1);
    }
  });

  it("ignores what an old socket still says", () => {
    socket().say(snapshot());
    const old = socket();
    const stale = old.onmessage;
    old.onclose?.();
    stale?.({ data: JSON.stringify(change(2, { mode: "playing" })) });
    expect(store.get().live?.mode).toBe("idle");
  });

  it("tells what was saved, and keeps events", () => {
    const saved: string[] = [];
    store.onSaved((message) => saved.push(message.id));
    socket().say(snapshot());
    socket().say({ kind: "saved", sequence: 2, what: "run", id: "r1" });
    socket().say({ kind: "event", sequence: 3, event: { number: 1, code: "mode", message: "idle" } });
    expect(saved).toEqual(["r1"]);
    expect(store.get().events.map((event) => event.code)).toEqual(["mode"]);
  });

  it("judges by the age of what comes: what waited on its way is old, by whatever clock the service goes", () => {
    // The service's clock is an hour behind.
    const sent_at = (lateMs: number) => new Date(Date.now() - 3_600_000 - lateMs).toISOString();
    socket().say({ ...snapshot(), sent_at: sent_at(0) });
    expect(isAlive(store.get())).toBe(true);
    socket().say({ ...change(2, { mode: "playing" }), sent_at: sent_at(LOST_AFTER_MS + 1) });
    expect(isAlive(store.get())).toBe(false);
    expect(ageTenths(store.get(), Date.now())).toBe(12);
    socket().say({ ...change(3, {}), sent_at: sent_at(20) });
    expect(isAlive(store.get())).toBe(true);
  });

  describe("after the page itself has stood still", () => {
    const sent = (message: object, at: number) => ({ ...message, sent_at: new Date(at).toISOString() });
    /** Nothing of the page runs meanwhile, as while it draws; what comes waits. */
    const standStill = (ms: number) => vi.setSystemTime(Date.now() + ms);

    beforeEach(() => {
      socket().say(sent(snapshot(), Date.now()));
      vi.advanceTimersByTime(500);
    });

    it("hears first what waited for it: that was no loss of the connection", () => {
      const before = Date.now();
      const heard = vi.fn();
      standStill(3000);
      store.subscribe(() => heard(store.get().connected));
      for (let n = 2; n < 30; n++) socket().say(sent(change(n, {}), before + 100 * n));
      vi.advanceTimersByTime(SETTLE_MS);
      socket().say(sent(change(30, {}), Date.now()));
      vi.advanceTimersByTime(LOST_AFTER_MS - SETTLE_MS);
      expect(heard).not.toHaveBeenCalledWith(false);
      expect(sockets).toHaveLength(1);
    });

    it.each([
      ["nothing waited", 0],
      ["what waited is old", 10],
    ])("says so soon when the connection was lost meanwhile: %s", (_, waited) => {
      const before = Date.now();
      standStill(3000);
      for (let n = 2; n < 2 + waited; n++) socket().say(sent(change(n, {}), before + n));
      vi.advanceTimersByTime(500);
      expect(store.get().connected).toBe(false);
    });
  });

  it("takes two clocks that drift apart for two clocks", () => {
    const began = Date.now();
    socket().say({ ...snapshot(), sent_at: new Date(began).toISOString() });
    // In an hour the service's clock loses three seconds.
    for (let n = 2; n < 3600; n++) {
      vi.advanceTimersByTime(1000);
      const passed = Date.now() - began;
      socket().say({ ...change(n, {}), sent_at: new Date(began + passed * (1 - 3 / 3600)).toISOString() });
      expect(store.get().connected).toBe(true);
    }
  });

  it("does not wait for a connection that nobody answers", () => {
    vi.advanceTimersByTime(OPEN_WITHIN_MS + 500);
    expect(sockets[0]?.closed).toBe(true);
    vi.advanceTimersByTime(250);
    expect(sockets).toHaveLength(2);
  });

  it("asks for Stop over the connection that is open, and tells what the device said", async () => {
    socket().say(snapshot());
    const stopped = store.stop();
    expect(socket().sent).toEqual(['{"kind":"stop","number":1}']);
    const answer = { kind: "stop_answer", sequence: 2, number: 1, refusal: null };
    socket().say(answer);
    expect(await stopped).toEqual(answer);
  });

  it.each([
    ["nobody is connected", () => {}, () => {}],
    ["no answer comes in time", () => socket().say(snapshot()), () => vi.advanceTimersByTime(STOP_ANSWER_MS)],
    ["the connection ends", () => socket().say(snapshot()), () => socket().onclose?.()],
  ])("says that Stop has to go another way when %s", async (_, before, after) => {
    before();
    const stopped = store.stop();
    after();
    expect(await stopped).toBeNull();
  });

  it("tells when what is shown is newer than an answer, or that nobody tells any more", async () => {
    await store.told();
    socket().say(snapshot());
    let told = false;
    const telling = store.told().then(() => {
      told = true;
    });
    socket().say(change(2, {}));
    await Promise.resolve();
    expect(told).toBe(false);
    socket().say(change(3, {}));
    await telling;
    const lost = store.told();
    vi.advanceTimersByTime(LOST_AFTER_MS + 500);
    await lost;
  });
});
