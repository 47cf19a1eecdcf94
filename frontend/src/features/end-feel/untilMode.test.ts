import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { LiveState } from "../../lib/live/store";
import { untilMode } from "./untilMode";

let listener = () => {};
let state: Partial<LiveState> = {};
const store = {
  get: () => state as LiveState,
  subscribe: (given: () => void) => {
    listener = given;
    return () => {};
  },
};
const becomes = (mode: string, run_id: string | null, more: object = {}) => {
  const live = { mode, stop: null, run: run_id && { run_id }, ...more } as unknown as LiveState["live"];
  state = { connected: true, live };
  listener();
};
const waits = () => untilMode(store, { mode: "ready", runId: "r", within_ms: 1000 });

beforeEach(() => {
  vi.useFakeTimers();
  becomes("idle", null);
});
afterEach(() => vi.useRealTimers());

it("waits for the mode of the loaded run", async () => {
  const waiting = waits();
  becomes("idle", null);
  becomes("ready", "another");
  becomes("ready", "r");
  expect(await waiting).toBe(true);
});

it("gives up when the apparatus stops", async () => {
  const waiting = waits();
  becomes("stopped", "r", { stop: { code: "operator_stop" } });
  expect(await waiting).toBe(false);
});

it("gives up when the run is gone", async () => {
  const waiting = waits();
  becomes("approaching", "r");
  becomes("idle", null);
  expect(await waiting).toBe(false);
});

it("gives up after its time", async () => {
  const waiting = waits();
  vi.advanceTimersByTime(1001);
  expect(await waiting).toBe(false);
});
