import { QueryClient } from "@tanstack/react-query";
import createClient from "openapi-fetch";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LiveStore } from "../../lib/live/store";
import { AuthStore } from "./authState";
import { ActivityTracker, authMiddleware, startSessionGuard } from "./sessionGuard";
import { ME, VIEWER } from "./testUsers";

const me = vi.fn();
const nothing = async () => undefined;
let auth: AuthStore;

beforeEach(() => {
  vi.useFakeTimers();
  me.mockReset().mockResolvedValue(ME);
  auth = new AuthStore({ me, lock: nothing, signOut: nothing });
});
afterEach(() => {
  vi.useRealTimers();
});

describe("a request", () => {
  const send = vi.fn<(request: Request) => Promise<Response>>();
  const problem = (status: number, code: string) => Response.json({ code }, { status });
  let now = 0;
  const connect = () => {
    const client = createClient<Record<string, { get: unknown }>>({ baseUrl: "http://kata", fetch: send });
    const activity = new ActivityTracker(() => now);
    client.use(authMiddleware(auth, activity));
    const get = (path = "/api/any") => (client.GET as (path: string) => Promise<unknown>)(path);
    return { doing: activity, get };
  };

  beforeEach(() => {
    now = 0;
    send.mockReset().mockImplementation(async () => Response.json({}));
  });

  it("reports user activity, but not polling", async () => {
    const { doing: activity, get } = connect();
    now = 60_000;
    await get();
    expect(send.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBeNull();
    activity.record();
    now += 1_000;
    await get();
    expect(send.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBe("1");
    now += 60_000;
    await get();
    expect(send.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBeNull();
  });

  it("is marked as a refresh until the user opens a page", async () => {
    const { doing: activity, get } = connect();
    const isMarked = () => send.mock.calls.at(-1)?.[0].headers.get("X-Kata-Refresh") === "1";
    const marks: boolean[] = [];
    for (const path of ["/api/any", "/api/any", "/api/other", "/api/any"]) {
      await get(path);
      marks.push(isMarked());
    }
    activity.open();
    await get();
    expect([...marks, isMarked()]).toEqual([false, true, false, true, false]);
  });

  it("that is unauthenticated ends the login", async () => {
    auth.signedIn(ME);
    send.mockResolvedValue(problem(401, "not_signed_in"));
    await connect().get();
    expect(auth.get()).toEqual({ is: "out", why: "ended" });
  });

  it("from before a sign-in does not end the login when its refusal is late", async () => {
    let answer = (_: Response) => {};
    send.mockReturnValue(new Promise((resolve) => (answer = resolve)));
    const asked = connect().get();
    await vi.advanceTimersByTimeAsync(0);
    auth.signedIn(ME);
    answer(problem(401, "not_signed_in"));
    await asked;
    expect(auth.get().is).toBe("in");
  });

  it("that is refused as locked shows the lock screen", async () => {
    auth.signedIn(ME);
    me.mockResolvedValue({ ...ME, locked: true });
    send.mockResolvedValue(problem(423, "locked"));
    await connect().get();
    expect(auth.get().is).toBe("locked");
  });

  it("with a wrong password does not sign out", async () => {
    auth.signedIn(ME);
    send.mockResolvedValue(problem(401, "wrong_password"));
    await connect().get();
    expect(auth.get().is).toBe("in");
  });
});

describe("the guard", () => {
  const sockets: { close: () => void; onclose: (() => void) | null }[] = [];
  const queries = new QueryClient();
  const switchLanguage = vi.fn();
  const settle = () => vi.advanceTimersByTimeAsync(0);
  let stop: () => void;
  let now: number;
  let activity: ActivityTracker;
  let store: LiveStore;

  beforeEach(async () => {
    sockets.length = 0;
    now = 0;
    activity = new ActivityTracker(() => now);
    store = new LiveStore(() => {
      const socket = { close: vi.fn(), onclose: null, onmessage: null, onerror: null };
      sockets.push(socket);
      return socket as unknown as WebSocket;
    });
    switchLanguage.mockReset();
    stop = startSessionGuard(auth, activity, queries, store, switchLanguage);
    await settle();
  });
  afterEach(() => stop());

  it("discards fetched and late data when locked", async () => {
    queries.setQueryData(["patient", "p"], { name: "Yamada Hanako" });
    let answer: (found: unknown) => void = () => {};
    const pending = queries
      .fetchQuery({ queryKey: ["patient", "q"], queryFn: () => new Promise((resolve) => (answer = resolve)) })
      .catch(() => null);
    await auth.lock();
    answer({ name: "Mori Sakura" });
    await pending;
    expect(
      queries
        .getQueryCache()
        .getAll()
        .map((query) => query.state.data),
    ).toEqual([]);
  });

  it("stays connected when locked, and disconnects when signed out", async () => {
    expect(sockets).toHaveLength(1);
    await auth.lock();
    expect(sockets[0]?.close).not.toHaveBeenCalled();
    me.mockResolvedValue(null);
    await auth.signOut();
    expect(sockets[0]?.close).toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(10_000);
    expect(sockets).toHaveLength(1);
  });

  it("applies the user's language only at sign-in", async () => {
    expect(switchLanguage).toHaveBeenCalledExactlyOnceWith(ME.language);
    me.mockResolvedValue({ ...ME, language: "ja" });
    await auth.refresh();
    await auth.lock();
    auth.signedIn({ ...ME, language: "ja" });
    expect(switchLanguage, "chosen at another browser").toHaveBeenCalledTimes(1);
    auth.signedIn({ ...VIEWER, language: "ja" });
    expect(switchLanguage).toHaveBeenLastCalledWith("ja");
    auth.signedOut();
    auth.signedIn({ ...VIEWER, language: "en" });
    expect(switchLanguage).toHaveBeenLastCalledWith("en");
  });

  it("does not reload the page while motors are powered", async () => {
    switchLanguage.mockReset();
    vi.spyOn(store, "get").mockReturnValue({ ...store.get(), live: { mode: "playing" } as never });
    auth.signedIn({ ...VIEWER, language: "ja" });
    expect(switchLanguage).not.toHaveBeenCalled();
  });

  it("checks the login when the connection ends", async () => {
    me.mockResolvedValue(null);
    sockets[0]?.onclose?.();
    await settle();
    expect(auth.get()).toEqual({ is: "out", why: "ended" });
  });

  it("locks after inactivity, even without the service", async () => {
    me.mockRejectedValue(new Error("no answer"));
    now = 1000 * ME.idle_s - 1;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(auth.get().is).toBe("in");
    activity.record();
    now += 1000 * ME.idle_s + 1;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(auth.get().is).toBe("locked");
  });
});
