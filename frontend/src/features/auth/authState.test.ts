import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { AuthStore } from "./authState";
import { ME, VIEWER } from "./examples";

const me = vi.fn();
const lock = vi.fn();
const signOut = vi.fn();
const left = vi.fn();
let access: AuthStore;

beforeEach(() => {
  vi.resetAllMocks();
  me.mockResolvedValue(ME);
  lock.mockResolvedValue(undefined);
  signOut.mockResolvedValue(undefined);
  access = new AuthStore({ me, lock, signOut });
  access.onLeaving(left);
});
afterEach(() => vi.restoreAllMocks());

describe("who is signed in", () => {
  it("is not known before the service has said it", async () => {
    expect(access.get()).toEqual({ is: "unknown" });
    await access.look();
    expect(access.get()).toEqual({ is: "in", me: ME });
  });

  it("stays as it is while the service does not answer", async () => {
    await access.look();
    me.mockRejectedValue(new Error("no answer"));
    await access.look();
    expect(access.get().is).toBe("in");
  });

  it("is nobody once the service says so, and it says that somebody was", async () => {
    await access.look();
    me.mockResolvedValue(null);
    await access.look();
    expect(access.get()).toEqual({ is: "out", why: "ended" });
  });

  it("is not taken from an answer that was asked for before somebody came", async () => {
    let answer: (nobody: null) => void = () => {};
    me.mockReturnValue(new Promise((resolve) => (answer = resolve)));
    const looking = access.look();
    access.came(ME);
    answer(null);
    await looking;
    expect(access.get()).toEqual({ is: "in", me: ME });
  });
});

describe("what is shown is forgotten", () => {
  it("when it is locked, when somebody leaves, and when somebody else comes", async () => {
    access.came(ME);
    left.mockClear();
    await access.lock();
    expect(left).toHaveBeenCalledTimes(1);
    access.came(ME);
    await access.signOut();
    left.mockClear();
    access.came(VIEWER);
    expect(left).toHaveBeenCalledTimes(1);
    access.came(ME);
    expect(left).toHaveBeenCalledTimes(2);
  });

  it("not when the same somebody is only looked at again", async () => {
    access.came(ME);
    left.mockClear();
    me.mockResolvedValue({ ...ME, second_factor: false });
    await access.look();
    expect(left).not.toHaveBeenCalled();
  });

  it("before anybody hears who is there now", async () => {
    const order: string[] = [];
    access.came(ME);
    access.onLeaving(() => order.push("forgotten"));
    access.subscribe(() => order.push("shown"));
    await access.lock();
    expect(order).toEqual(["forgotten", "shown"]);
  });
});

describe("the lock", () => {
  it("is at once, and stays though the service has not heard of it", async () => {
    access.came(ME);
    lock.mockRejectedValue(new Error("no answer"));
    await access.lock();
    expect(access.get().is).toBe("locked");
    await access.look();
    expect(access.get().is).toBe("locked");
    expect(lock).toHaveBeenCalledTimes(2);
    lock.mockResolvedValue(undefined);
    me.mockResolvedValue(ME);
    await access.look();
    expect(lock).toHaveBeenCalledTimes(3);
    me.mockResolvedValue({ ...ME, locked: true });
    await access.look();
    expect(access.get().is).toBe("locked");
    expect(lock).toHaveBeenCalledTimes(3);
  });

  it("is shown when the service has locked it, and gone when it is unlocked", async () => {
    me.mockResolvedValue({ ...ME, locked: true });
    await access.look();
    expect(access.get().is).toBe("locked");
    access.came(ME);
    expect(access.get().is).toBe("in");
  });
});

describe("signing out", () => {
  it("is at once, and told again until the service has heard of it", async () => {
    access.came(ME);
    signOut.mockRejectedValueOnce(new Error("no answer"));
    await access.signOut();
    expect(access.get()).toEqual({ is: "out", why: "unheard" });
    await access.look();
    expect(signOut).toHaveBeenCalledTimes(2);
    expect(access.get()).toEqual({ is: "out", why: "left" });
  });
});
