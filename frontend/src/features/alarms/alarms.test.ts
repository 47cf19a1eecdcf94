import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../../lib/api/client";
import { type LiveState, LOST_AFTER_MS } from "../../lib/live/store";
import { estopState } from "../../safety/EstopBadge";
import { type Alarm, activeAlarms } from "./alarms";
import { AlarmSounder, BURSTS, SOUND_PAUSE_MS, SoundPause } from "./sound";

const DATABASE_OK = { unavailable_since: null, waiting: 0, spool_full_since: null };
const IDLE = {
  device: "running",
  age_ms: 5,
  mode: "idle",
  estop: "closed",
  torque: "off",
  database: DATABASE_OK,
  warnings: [],
  refusals: {},
};

function priorities(live: object, overrides: Partial<LiveState> = {}) {
  const state = {
    connected: true,
    heardAt: 0,
    station: null,
    events: [],
    live: { ...IDLE, ...live },
    ...overrides,
  };
  return activeAlarms(state as unknown as LiveState).map(({ code, priority }) => `${priority} ${code}`);
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
  it("is absent when all is well or nothing was received", () => {
    expect(priorities({})).toEqual([]);
    expect(priorities({}, { connected: false, heardAt: null })).toEqual([]);
    expect(priorities({ device: "starting" })).toEqual([]);
  });

  it("of a stop is high until cleared and released", () => {
    const stop = (cleared: boolean, arm_held = false) => ({ stop: { causes: [cause(cleared)], arm_held } });
    expect(priorities(stop(false))).toEqual(["high stop estop_pressed"]);
    expect(priorities(stop(true, true))).toEqual(["high stop estop_pressed"]);
    expect(priorities(stop(true))).toEqual(["medium stop estop_pressed"]);
  });

  it("of a lost view depends on the torque", () => {
    expect(priorities({ torque: "on" }, { connected: false })).toEqual(["high connection_lost"]);
    expect(priorities({}, { connected: false })).toEqual(["medium connection_lost"]);
    expect(priorities({ torque: "on", age_ms: LOST_AFTER_MS })).toEqual(["high device_silent"]);
  });

  it("is low while a technician commissions the station", () => {
    const teach = { code: "commissioning_runs", message: "It runs.", next_step: "Wait." };
    const live = { device: "restarting", mode: "offline", torque: "unknown", refusals: { teach } };
    expect(priorities(live)).toEqual(["low commissioning"]);
  });

  it("is high for a silent e-stop without a reported stop", () => {
    expect(priorities({ estop: "unknown" })).toEqual(["high estop_missing"]);
    const stop = { causes: [cause(false, "estop_unknown")], arm_held: false };
    expect(priorities({ estop: "unknown", stop })).toEqual(["high stop estop_unknown"]);
  });

  it("is low without database, medium when writes are lost", () => {
    const SINCE = "2026-11-22T05:00:07Z";
    const away = { database: { ...DATABASE_OK, unavailable_since: SINCE } };
    expect(priorities(away)).toEqual(["low database_away"]);
    expect(
      priorities({ database: { ...DATABASE_OK, unavailable_since: SINCE, spool_full_since: SINCE } }),
    ).toEqual(["medium spool_full"]);
    expect(priorities(away, { connected: false })).toEqual(["medium connection_lost"]);
  });

  it("is medium for each drive near its own limit", () => {
    const hot = (motor: number) => ({ code: "drive_hot", motor, message: "It is hot.", next_step: "Wait." });
    expect(priorities({ warnings: [hot(2), hot(3)] })).toEqual(["medium drive_hot 2", "medium drive_hot 3"]);
    expect(priorities({ warnings: [hot(2)] }, { connected: false })).toEqual(["medium connection_lost"]);
  });

  it("sorts the most urgent first", () => {
    const run = { reversing: true, resistance: "Motor 3 met resistance." };
    const lease = { unreachable_since: "2026-11-21T09:00:00Z" };
    expect(priorities({ run, lease, torque: "on", estop: "unknown" })).toEqual([
      "high estop_missing",
      "medium operator_unreachable",
      "low reversing",
    ]);
  });
});

describe("the emergency stop", () => {
  it("distinguishes missing from unknown among its five states", () => {
    const contacts = ["closed", "pressed", "released", "unknown"] as const;
    expect(contacts.map((contact) => estopState(true, contact as Live["estop"]))).toEqual([
      "closed",
      "pressed",
      "released",
      "missing",
    ]);
    expect(contacts.map((contact) => estopState(false, contact))).toEqual(Array(4).fill("unknown"));
  });
});

describe("the sound", () => {
  it("stays paused for old alarms but not for new ones", () => {
    const pause = new SoundPause();
    const alarms = [alarm("a", "high")];
    expect(pause.audible(alarms, 0)?.code).toBe("a");
    pause.pause(alarms, 0);
    expect(pause.audible(alarms, 1)).toBeNull();
    expect(pause.audible([...alarms, alarm("b", "low")], 2)?.code).toBe("b");
    expect(pause.audible(alarms, SOUND_PAUSE_MS)?.code).toBe("a");
  });

  it("sounds again for an alarm that returns", () => {
    const pause = new SoundPause();
    pause.pause([alarm("a")], 0);
    expect(pause.audible([], 1)).toBeNull();
    expect(pause.audible([alarm("a")], 2)?.code).toBe("a");
  });

  it("can be resumed by hand", () => {
    const pause = new SoundPause();
    pause.pause([alarm("a")], 0);
    pause.resume();
    expect(pause.audible([alarm("a")], 1)?.code).toBe("a");
  });

  it("is shorter and more frequent for more urgent alarms", () => {
    expect([BURSTS.high, BURSTS.medium, BURSTS.low].map((burst) => burst.pulseStarts_s.length)).toEqual([
      10, 3, 2,
    ]);
    expect(BURSTS.high.repeat_s).toBeLessThan(BURSTS.medium.repeat_s);
    expect(BURSTS.medium.repeat_s).toBeLessThan(BURSTS.low.repeat_s);
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

  it("repeat until cleared and wait for the browser's permission", () => {
    const sounder = new AlarmSounder(() => context as unknown as AudioContext);
    sounder.sound(alarm("a", "high"));
    expect(started).toHaveLength(0);
    sounder.unlockAudio();
    vi.advanceTimersByTime(BURSTS.high.repeat_s * 1000);
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
