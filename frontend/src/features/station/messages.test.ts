import { describe, expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { describeMode } from "../../safety/modes";
import { describeLoop } from "./LoopHealth";
import { describePath } from "./ReversalNotice";

const run = { at_start: false, reversing: false, reversals: 0 } as Schemas["RunLive"];
const stop = { causes: [], arm_held: false } as Schemas["StopLive"];
const loop = {
  cycle_hz: 100,
  overruns: 0,
  lateness_p999_ms: 0.214,
  real_time: true,
  memory_locked: true,
} as Schemas["LoopLive"];

describe("the state on the path", () => {
  it.each([
    ["playing", {}, "Playing"],
    ["playing", { reversing: true }, "Moving back after resistance"],
    ["paused", {}, "Paused, holding"],
    ["paused", { at_start: true }, "At the start, holding"],
    ["paused", { reversing: true }, "Moved back, holding"],
    // The arm was moved back to the start, so the text must differ from that of a loaded run.
    ["paused", { at_start: true, reversing: true }, "Moved back, holding"],
  ] as const)("%s with %o", (mode, part, words) => {
    expect(describePath(mode, { ...run, ...part })).toBe(words);
  });
});

describe("the apparatus state", () => {
  const MODES = [
    "offline",
    "idle",
    "teaching",
    "ready",
    "approaching",
    "playing",
    "paused",
    "returning",
    "stopped",
  ] as const;

  it.each(MODES)("names the torque that the drives report while %s", (mode) => {
    const words = (["on", "off", "unknown", null] as const).map((torque) =>
      describeMode({ mode, torque, stop: null, run: null }),
    );
    const state = words[0]?.replace(/, torque on$/, "");
    expect(words).toEqual(["on", "off", "unknown", "unknown"].map((torque) => `${state}, torque ${torque}`));
  });

  it("says after a stop if the motors hold the arm", () => {
    const held = { ...stop, arm_held: true };
    const describeStop = (torque: "on" | "unknown") =>
      describeMode({ mode: "stopped", torque, stop: held, run: null });
    expect(describeStop("on")).toBe("Stopped, holding, torque on");
    // The arm counts as held, because the motors may hold it.
    expect(describeStop("unknown")).toBe("Stopped, torque unknown");
  });

  it("distinguishes playing from taking the arm back", () => {
    expect(describeMode({ mode: "playing", torque: "on", stop: null, run })).toBe("Playing, torque on");
    expect(
      describeMode({ mode: "playing", torque: "on", stop: null, run: { ...run, reversing: true } }),
    ).toBe("Moving back after resistance, torque on");
  });
});

describe("the control loop's timing", () => {
  it("is one line", () => {
    expect(describeLoop(loop)).toBe(
      "Control loop at 100\u00a0Hz: no cycle missed · 99.9\u00a0% of cycles began within 0.21\u00a0ms · real-time priority granted · memory locked",
    );
  });

  it("names missing grants and missed cycles", () => {
    const words = describeLoop({ ...loop, overruns: 1, real_time: false, memory_locked: false });
    expect(words).toContain("1 cycle missed");
    expect(words).toContain("real-time priority not granted · memory not locked");
    expect(describeLoop({ ...loop, overruns: 2 })).toContain("2 cycles missed");
  });
});
