import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../../lib/api/client";
import { type LiveState, LOST_AFTER_MS } from "../../lib/live/store";
import { estopLook } from "../../safety/EstopBadge";
import { type Alarm, alarmsOf } from "./alarms";
import { BURSTS, PAUSED_MS, Pausing, Sounder } from "./sound";

const DATABASE = { unavailable_since: null, waiting: 0, spool_full_since: null };
const IDLE = {
  device: "running",
  age_ms: 5,
  mode: "idle",
  estop: "closed",
  torque: "off",
  database: DATABASE,
};

function priorities(live: object, around: Partial<LiveState> = {}) {
  const state = {
    connected: true,
    heardAt: 0,
    station: null,
    events: [],
    live: { ...IDLE, ...live },
    ...around,
  };
  return alarmsOf(state as unknown as LiveState).map(({ code, priority }) => `${priority} ${code}`);
}

const cause = (cleared: boolean, code = "estop_pressed") => ({
  code,
  cleared,
  message: "It.",
  next_step: "Do.",
});
const alarm = (code: string, priority: Alarm["priority"] = "medium"): Alarm => ({
  code,
  priority,
  message: "",
  nextStep: "",
});

describe("an alarm's priority", () => {
  it("is none while all is well, and before anything was heard", () => {
    expect(priorities({})).toEqual([]);
    expect(priorities({}, { connected: false, heardAt: null })).toEqual([]);
    expect(priorities({ device: "starting" })).toEqual([]);
  });

  it("of a stop is high while a cause stands or the arm is held, and medium once it waits to be acknowledged", () => {
    const stop = (cleared: boolean, arm_held = false) => ({ stop: { causes: [cause(cleared)], arm_held } });
    expect(priorities(stop(false))).toEqual(["high stop estop_pressed"]);
    expect(priorities(stop(true, true))).toEqual(["high stop estop_pressed"]);
    expect(priorities(stop(true))).toEqual(["medium stop estop_pressed"]);
  });

  it("of what cannot be seen any more depends on whether it may still move an arm", () => {
    expect(priorities({ torque: "on" }, { connected: false })).toEqual(["high connection_lost"]);
    expect(priorities({}, { connected: false })).toEqual(["medium connection_lost"]);
    expect(priorities({ torque: "on", age_ms: LOST_AFTER_MS })).toEqual(["high device_silent"]);
  });

  it("is high for an emergency stop that does not answer, unless a stop says so already", () => {
    expect(priorities({ estop: "unknown" })).toEqual(["high estop_missing"]);
    const stop = { causes: [cause(false, "estop_unknown")], arm_held: false };
    expect(priorities({ estop: "unknown", stop })).toEqual(["high stop estop_unknown"]);
  });

  it("is low for a database that is away, and medium once the disk takes nothing, either", () => {
    const SINCE = "2026-11-22T05:00:07Z";
    const away = { database: { ...DATABASE, unavailable_since: SINCE } };
    expect(priorities(away)).toEqual(["low database_away"]);
    expect(
      priorities({ database: { ...DATABASE, unavailable_since: SINCE, spool_full_since: SINCE } }),
    ).toEqual(["medium not_kept"]);
    expect(priorities(away, { connected: false })).toEqual(["medium connection_lost"]);
  });

  it("puts the most urgent first", () => {
    const run = { reversing: true, resistance: "Motor 3 met resistance." };
    const lease = { unreachable_since: "2026-11-21T09:00:00Z" };
    expect(priorities({ run, lease, torque: "on", estop: "unknown" })).toEqual([
      "high estop_missing",
      "medium holder_away",
      "low reversing",
    ]);
  });
});

describe("the emergency stop", () => {
  it("has five looks: what the apparatus does not hear is missing, what nobody tells is unknown", () => {
    const told = ["closed", "pressed", "released", "unknown"] as const;
    expect(told.map((one) => estopLook(true, one as Live["estop"]))).toEqual([
      "closed",
      "pressed",
      "released",
      "missing",
    ]);
    expect(told.map((one) => estopLook(false, one))).toEqual(Array(4).fill("unknown"));
  });
});

describe("the sound", () => {
  it("that is paused stays so for the alarms that stood, and a new one is heard", () => {
    const pausing = new Pausing();
    const old = [alarm("a", "high")];
    expect(pausing.heard(old, 0)?.code).toBe("a");
    pausing.pause(old, 0);
    expect(pausing.heard(old, 1)).toBeNull();
    expect(pausing.heard([...old, alarm("b", "low")], 2)?.code).toBe("b");
    expect(pausing.heard(old, PAUSED_MS)?.code).toBe("a");
  });

  it("is heard again for an alarm that went and came again", () => {
    const pausing = new Pausing();
    pausing.pause([alarm("a")], 0);
    expect(pausing.heard([], 1)).toBeNull();
    expect(pausing.heard([alarm("a")], 2)?.code).toBe("a");
  });

  it("is turned on again by whoever paused it", () => {
    const pausing = new Pausing();
    pausing.pause([alarm("a")], 0);
    pausing.resume();
    expect(pausing.heard([alarm("a")], 1)?.code).toBe("a");
  });

  it("is the shorter and the sooner again, the more urgent the alarm is", () => {
    expect([BURSTS.high, BURSTS.medium, BURSTS.low].map((one) => one.beats_s.length)).toEqual([10, 3, 2]);
    expect(BURSTS.high.again_s).toBeLessThan(BURSTS.medium.again_s);
    expect(BURSTS.medium.again_s).toBeLessThan(BURSTS.low.again_s);
  });
});

describe("bursts", () => {
  const started: number[] = [];
  const param = () => ({ value: 0, setValueAtTime() {}, linearRampToValueAtTime() {} });
  const node = () => ({
    frequency: param(),
    gain: param(),
    connect: (to: unknown) => to,
    start: (at: number) => started.push(at),
    stop() {},
  });
  const context = {
    state: "running",
    currentTime: 0,
    createOscillator: node,
    createGain: node,
    destination: {},
  };

  beforeEach(() => {
    vi.useFakeTimers();
    started.length = 0;
  });
  afterEach(() => vi.useRealTimers());

  it("go on until there is no alarm, and wait until a browser allows them", () => {
    const sounder = new Sounder(() => context as unknown as AudioContext);
    sounder.sound(alarm("a", "high"));
    expect(started).toHaveLength(0);
    sounder.allow();
    vi.advanceTimersByTime(BURSTS.high.again_s * 1000);
    expect(started).toHaveLength(10);
    sounder.sound(alarm("a", "high"));
    expect(started).toHaveLength(10);
    sounder.sound(alarm("b", "medium"));
    expect(started).toHaveLength(13);
    sounder.sound(null);
    vi.advanceTimersByTime(60_000);
    expect(started).toHaveLength(13);
  });
});
