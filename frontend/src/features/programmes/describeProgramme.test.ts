import { describe, expect, it } from "vitest";
import type { ProgrammeItem, ProgrammeVersion } from "../../lib/api/client";
import { AS_TAUGHT } from "../station/playSettingsModel";
import { changes, itemWords, timerWords, versionWords } from "./describeProgramme";

const item = (name: string, given: Partial<ProgrammeItem> = {}): ProgrammeItem => ({
  ...AS_TAUGHT,
  position: 1,
  recording_id: name,
  recording_name: name,
  recording_archived: false,
  duration_s: 90,
  load_level: 8,
  ...given,
});
const version = (items: ProgrammeItem[], given: Partial<ProgrammeVersion> = {}): ProgrammeVersion => ({
  id: "v",
  number: 1,
  made_at: "2026-11-21T09:30:00Z",
  made_by: "Aoki",
  note: "",
  timer_minutes: null,
  sessions_per_week: null,
  duration_s: 90 * items.length,
  items,
  ...given,
});

describe("the description of a programme", () => {
  it("lists its settings", () => {
    expect(itemWords(item("Lift"))).toBe("As it was taught, once; resistance level 8 of 25");
    expect(itemWords(item("Lift", { range_percent: 80, repetitions: 10, pause_s: 2, load_level: 5 }))).toBe(
      "80 % of the range, 10 repetitions, 2 s of pause at each end; resistance level 5 of 25",
    );
    expect(itemWords({ ...item("Lift"), load_level: null, method: null })).toBe("As it was taught, once");
    expect(versionWords(version([item("Lift")]))).toBe("1 recording, 1:30 of playing");
    const more = { timer_minutes: 20, sessions_per_week: 3 };
    expect(versionWords(version([item("Lift"), item("Turn")], more))).toBe(
      "2 recordings, 3:00 of playing, timer 20 minutes, 3 sessions a week",
    );
  });

  it("compares the duration with the timer", () => {
    expect(timerWords(null, 5000)).toBeNull();
    expect(timerWords(2, 120)).toBeNull();
    expect(timerWords(1, 120)).toContain(
      "This takes 2:00, and after 1 minute of playing no further recording",
    );
  });
});

describe("the changes between two versions", () => {
  it("are listed by recording", () => {
    const before = version([item("Lift"), item("Turn"), item("Reach")]);
    const after = version([item("Lift", { range_percent: 80, load_level: 5 }), item("Reach"), item("Hold")]);
    expect(changes(before, after)).toEqual([
      "Turn is left out",
      "Lift: range 80 % instead of 100 %, resistance level 5 instead of 8",
      "Hold is new: as it was taught, once; resistance level 8 of 25",
    ]);
  });

  it("include order, timer and frequency", () => {
    const before = version([item("Lift"), item("Turn")], { timer_minutes: 20 });
    const after = version([item("Turn", { method: "learned" }), item("Lift")], { sessions_per_week: 1 });
    expect(changes(before, after)).toEqual([
      "Turn: way of playing learned instead of smooth",
      "The order is another one",
      "The timer of 20 minutes is gone",
      "The wish is 1 session a week",
    ]);
    expect(changes(version([], { timer_minutes: 20 }), version([], { timer_minutes: 15 }))).toEqual([
      "The timer is 15 minutes instead of 20",
    ]);
  });

  it("match repeated recordings by order", () => {
    const twice = version([item("Lift"), item("Lift", { speed_percent: 50 })]);
    const once = version([item("Lift", { speed_percent: 50 })]);
    expect(changes(twice, once)).toEqual(["Lift (2) is left out", "Lift: speed 50 % instead of 100 %"]);
    expect(changes(twice, twice)).toEqual(["Nothing of what is played"]);
  });
});
