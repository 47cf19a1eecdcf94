import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { AuthStore } from "./authState";
import { ME, VIEWER } from "./testUsers";

const me = vi.fn();
const lock = vi.fn();
const signOut = vi.fn();
const onUserChange = vi.fn();
let auth: AuthStore;

beforeEach(() => {
  vi.resetAllMocks();
  me.mockResolvedValue(ME);
  lock.mockResolvedValue(undefined);
  signOut.mockResolvedValue(undefined);
  auth = new AuthStore({ me, lock, signOut });
  auth.onUserChange(onUserChange);
});
afterEach(() => vi.restoreAllMocks());

describe("the signed-in user", () => {
  it("is unknown before the service answers", async () => {
    expect(auth.get()).toEqual({ is: "unknown" });
    await auth.refresh();
    expect(auth.get()).toEqual({ is: "in", me: ME });
  });

  it("stays while the service does not answer", async () => {
    await auth.refresh();
    me.mockRejectedValue(new Error("no answer"));
    await auth.refresh();
    expect(auth.get().is).toBe("in");
  });

  it("is gone when the service says so", async () => {
    await auth.refresh();
    me.mockResolvedValue(null);
    await auth.refresh();
    expect(auth.get()).toEqual({ is: "out", why: "ended" });
  });

  it("ignores an answer requested before the sign-in", async () => {
    let answer: (nobody: null) => void = () => {};
    me.mockReturnValue(new Promise((resolve) => (answer = resolve)));
    const refreshing = auth.refresh();
    auth.signedIn(ME);
    answer(null);
    await refreshing;
    expect(auth.get()).toEqual({ is: "in", me: ME });
  });
});

describe("shown data is discarded", () => {
  it("on lock, on sign-out and for another user", async () => {
    auth.signedIn(ME);
    onUserChange.mockClear();
    await auth.lock();
    expect(onUserChange).toHaveBeenCalledTimes(1);
    auth.signedIn(ME);
    await auth.signOut();
    onUserChange.mockClear();
    auth.signedIn(VIEWER);
    expect(onUserChange).toHaveBeenCalledTimes(1);
    auth.signedIn(ME);
    expect(onUserChange).toHaveBeenCalledTimes(2);
  });

  it("but not when the same user is checked again", async () => {
    auth.signedIn(ME);
    onUserChange.mockClear();
    me.mockResolvedValue({ ...ME, second_factor: false });
    await auth.refresh();
    expect(onUserChange).not.toHaveBeenCalled();
  });

  it("before listeners see the new state", async () => {
    const order: string[] = [];
    auth.signedIn(ME);
    auth.onUserChange(() => order.push("forgotten"));
    auth.subscribe(() => order.push("shown"));
    await auth.lock();
    expect(order).toEqual(["forgotten", "shown"]);
  });
});

describe("the lock", () => {
  it("is immediate and stays without the service", async () => {
    auth.signedIn(ME);
    lock.mockRejectedValue(new Error("no answer"));
    await auth.lock();
    expect(auth.get().is).toBe("locked");
    await auth.refresh();
    expect(auth.get().is).toBe("locked");
    expect(lock).toHaveBeenCalledTimes(2);
    lock.mockResolvedValue(undefined);
    me.mockResolvedValue(ME);
    await auth.refresh();
    expect(lock).toHaveBeenCalledTimes(3);
    me.mockResolvedValue({ ...ME, locked: true });
    await auth.refresh();
    expect(auth.get().is).toBe("locked");
    expect(lock).toHaveBeenCalledTimes(3);
  });

  it("follows the service's lock and unlock", async () => {
    me.mockResolvedValue({ ...ME, locked: true });
    await auth.refresh();
    expect(auth.get().is).toBe("locked");
    auth.signedIn(ME);
    expect(auth.get().is).toBe("in");
  });
});

describe("signing out", () => {
  it("is immediate and repeated until the service confirms", async () => {
    auth.signedIn(ME);
    signOut.mockRejectedValueOnce(new Error("no answer"));
    await auth.signOut();
    expect(auth.get()).toEqual({ is: "out", why: "unheard" });
    await auth.refresh();
    expect(signOut).toHaveBeenCalledTimes(2);
    expect(auth.get()).toEqual({ is: "out", why: "left" });
  });
});
