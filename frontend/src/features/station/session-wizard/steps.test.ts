import { describe, expect, it } from "vitest";
import { FRESH } from "./examples";
import {
  canGoTo,
  type Item,
  isDone,
  nextItem,
  type SessionState,
  type Step,
  stepAfter,
  stepOf,
  stepsDone,
} from "./steps";

const answer = (check: SessionState["checks"][number]["check"]) => ({
  check,
  subject: "",
  at: "",
  by: "Ito Mai",
});
const CHECKED = (["identity", "side", "fixtures", "belt"] as const).map(answer);
const RUN = { programme_position: 1, outcome: "completed" } as SessionState["runs"][number];
const item = (position: number) => ({ position, recording_id: `r${position}` }) as Item;

describe("the current step", () => {
  it.each<[string, SessionState | null, Step]>([
    ["nothing has begun", null, "begin"],
    ["it has just begun", FRESH, "checklist"],
    ["one check is still open", { ...FRESH, checks: CHECKED.slice(1) }, "checklist"],
    ["everything is in order", { ...FRESH, checks: CHECKED }, "pain_before"],
    ["pain before is known, also none at all", { ...FRESH, checks: CHECKED, pain_before: 0 }, "play"],
    ["something was played, whatever was left out before", { ...FRESH, runs: [RUN] }, "play"],
    ["the worst pain is known", { ...FRESH, runs: [RUN], pain_during: 0 }, "pain_after"],
    ["pain after is known", { ...FRESH, runs: [RUN], pain_after: 0 }, "note"],
    ["it has ended", { ...FRESH, ended_at: "2026-11-21T09:30:00Z" }, "note"],
  ])("follows from the record when %s", (_, session, step) => {
    expect(stepOf(session)).toBe(step);
  });

  it.each<[SessionState, boolean, number]>([
    [FRESH, false, 1],
    // Another tablet answered the checks, and this one does not have the record yet.
    [FRESH, true, 3],
    [{ ...FRESH, runs: [RUN], pain_during: 0 }, true, 4],
  ])("has the steps before it done, at least those before a loaded motion", (session, isLoaded, done) => {
    expect(stepsDone(session, isLoaded)).toBe(done);
  });

  it("can go back within the session only", () => {
    expect(canGoTo("play", null)).toBe(false);
    expect(canGoTo("begin", null)).toBe(true);
    expect(canGoTo("checklist", { ...FRESH, runs: [RUN] })).toBe(true);
    const ended = { ...FRESH, ended_at: "2026-11-21T09:30:00Z" };
    expect(canGoTo("play", ended)).toBe(false);
    expect(canGoTo("note", ended)).toBe(true);
  });

  it("advances step by step", () => {
    expect(stepAfter("pain_before")).toBe("play");
    expect(stepAfter("note")).toBe("note");
  });
});

describe("the next item", () => {
  const items = [item(1), item(2)];

  it("is the first planned item without a completed run", () => {
    expect(nextItem(items, [])?.position).toBe(1);
    expect(nextItem(items, [RUN])?.position).toBe(2);
    expect(nextItem(items, [{ ...RUN, outcome: "stopped" }])?.position).toBe(1);
    expect(nextItem(items, [RUN, { ...RUN, programme_position: 2 }])).toBeNull();
    expect(nextItem([], [RUN])).toBeNull();
  });

  it("ignores runs outside the programme", () => {
    expect(isDone(item(1), [{ ...RUN, programme_position: null }])).toBe(false);
  });
});
