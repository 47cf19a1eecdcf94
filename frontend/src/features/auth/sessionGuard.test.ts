import { QueryClient } from "@tanstack/react-query";
import createClient from "openapi-fetch";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LiveStore } from "../../lib/live/store";
import { AuthStore } from "./authState";
import { ME, VIEWER } from "./examples";
import { ActivityTracker, authMiddleware, startSessionGuard } from "./sessionGuard";

const me = vi.fn();
const nothing = async () => undefined;
let access: AuthStore;

beforeEach(() => {
  vi.useFakeTimers();
  me.mockReset().mockResolvedValue(ME);
  access = new AuthStore({ me, lock: nothing, signOut: nothing });
});
afterEach(() => {
  vi.useRealTimers();
});

describe("a request", () => {
  const asked = vi.fn<(request: Request) => Promise<Response>>();
  const problem = (status: number, code: string) => Response.json({ code }, { status });
  let now = 0;
  const ask = () => {
    const client = createClient<Record<string, { get: unknown }>>({ baseUrl: "http://kata", fetch: asked });
    const doing = new ActivityTracker(() => now);
    client.use(authMiddleware(access, doing));
    return { doing, get: () => (client.GET as (path: string) => Promise<unknown>)("/api/any") };
  };

  beforeEach(() => {
    now = 0;
    asked.mockReset().mockImplementation(async () => Response.json({}));
  });

  it("tells of somebody's doing, and a page that only polls tells of none", async () => {
    const { doing, get } = ask();
    now = 60_000;
    await get();
    expect(asked.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBeNull();
    doing.did();
    now += 1_000;
    await get();
    expect(asked.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBe("1");
    now += 60_000;
    await get();
    expect(asked.mock.calls.at(-1)?.[0].headers.get("X-Kata-Active")).toBeNull();
  });

  it("that nobody signed in for takes away what is shown", async () => {
    access.came(ME);
    asked.mockResolvedValue(problem(401, "not_signed_in"));
    await ask().get();
    expect(access.get()).toEqual({ is: "out", why: "ended" });
  });

  it("that is refused because the screen is locked shows it locked", async () => {
    access.came(ME);
    me.mockResolvedValue({ ...ME, locked: true });
    asked.mockResolvedValue(problem(423, "locked"));
    await ask().get();
    expect(access.get().is).toBe("locked");
  });

  it("with a wrong password signs nobody out", async () => {
    access.came(ME);
    asked.mockResolvedValue(problem(401, "wrong_password"));
    await ask().get();
    expect(access.get().is).toBe("in");
  });
});

describe("the guard", () => {
  const sockets: { close: () => void; onclose: (() => void) | null }[] = [];
  const queries = new QueryClient();
  const speak = vi.fn();
  const settled = () => vi.advanceTimersByTimeAsync(0);
  let end: () => void;
  let now: number;
  let doing: ActivityTracker;
  let store: LiveStore;

  beforeEach(async () => {
    sockets.length = 0;
    now = 0;
    doing = new ActivityTracker(() => now);
    store = new LiveStore(() => {
      const socket = { close: vi.fn(), onclose: null, onmessage: null, onerror: null };
      sockets.push(socket);
      return socket as unknown as WebSocket;
    });
    speak.mockReset();
    end = startSessionGuard(access, doing, queries, store, speak);
    await settled();
  });
  afterEach(() => end());

  it("keeps nothing that was fetched once it is locked, and none of what comes afterwards", async () => {
    queries.setQueryData(["patient", "p"], { name: "Yamada Hanako" });
    let answer: (found: unknown) => void = () => {};
    const late = queries
      .fetchQuery({ queryKey: ["patient", "q"], queryFn: () => new Promise((resolve) => (answer = resolve)) })
      .catch(() => null);
    await access.lock();
    answer({ name: "Mori Sakura" });
    await late;
    expect(
      queries
        .getQueryCache()
        .getAll()
        .map((one) => one.state.data),
    ).toEqual([]);
  });

  it("listens to the apparatus behind a locked screen, and to nothing once nobody is signed in", async () => {
    expect(sockets).toHaveLength(1);
    await access.lock();
    expect(sockets[0]?.close).not.toHaveBeenCalled();
    me.mockResolvedValue(null);
    await access.signOut();
    expect(sockets[0]?.close).toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(10_000);
    expect(sockets).toHaveLength(1);
  });

  it("speaks the language of whoever comes, and changes it beneath nobody's hands", async () => {
    expect(speak).toHaveBeenCalledExactlyOnceWith(ME.language);
    me.mockResolvedValue({ ...ME, language: "ja" });
    await access.look();
    await access.lock();
    access.came({ ...ME, language: "ja" });
    expect(speak, "chosen at another browser").toHaveBeenCalledTimes(1);
    access.came({ ...VIEWER, language: "ja" });
    expect(speak).toHaveBeenLastCalledWith("ja");
    access.left();
    access.came({ ...VIEWER, language: "en" });
    expect(speak).toHaveBeenLastCalledWith("en");
  });

  it("loads nothing anew while the motors move or hold an arm, whoever comes", async () => {
    speak.mockReset();
    vi.spyOn(store, "get").mockReturnValue({ ...store.get(), live: { mode: "playing" } as never });
    access.came({ ...VIEWER, language: "ja" });
    expect(speak).not.toHaveBeenCalled();
  });

  it("asks at once who is there when its connection is ended", async () => {
    me.mockResolvedValue(null);
    sockets[0]?.onclose?.();
    await settled();
    expect(access.get()).toEqual({ is: "out", why: "ended" });
  });

  it("locks after the time without doing, though no service answers", async () => {
    me.mockRejectedValue(new Error("no answer"));
    now = 1000 * ME.idle_s - 1;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(access.get().is).toBe("in");
    doing.did();
    now += 1000 * ME.idle_s + 1;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(access.get().is).toBe("locked");
  });
});
