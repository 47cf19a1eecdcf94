import { describe, expect, it } from "vitest";
import type { ProgrammeItem, ProgrammeVersion } from "../../lib/api/client";
import { AS_TAUGHT } from "../station/playSettingsModel";
import { changes, describeItem, describeTimer, describeVersion } from "./describeProgramme";

const item = (name: string, given: Partial<ProgrammeItem> = {}): ProgrammeItem => ({
  ...AS_TAUGHT,
  position: 1,
  recording_id: name,
  recording_name: name,
  recording_archived: false,
  duration_s: 90,
  resistance_level: 8,
  self_paced: false,
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
    expect(describeItem(item("Lift"))).toBe("As taught, once; resistance level 8\u00a0of\u00a025");
    expect(
      describeItem(item("Lift", { range_percent: 80, repetitions: 10, pause_s: 2, resistance_level: 5 })),
    ).toBe(
      "80\u00a0% of the range, 10 repetitions, pause of 2\u00a0s at each end; resistance level 5\u00a0of\u00a025",
    );
    expect(describeItem({ ...item("Lift"), resistance_level: null, method: null })).toBe("As taught, once");
    expect(describeVersion(version([item("Lift")]))).toBe("1 recording, playing time 1\u00a0min 30\u00a0s");
    const more = { timer_minutes: 20, sessions_per_week: 3 };
    expect(describeVersion(version([item("Lift"), item("Turn")], more))).toBe(
      "2 recordings, playing time 3\u00a0min, timer 20\u00a0minutes, 3\u00a0sessions per week",
    );
  });

  it("has a playing time that is the sum of the shown ones", () => {
    const short = version([item("Lift", { duration_s: 9.6 }), item("Turn", { duration_s: 15.3 })]);
    expect(describeVersion({ ...short, duration_s: 24.9 })).toBe("2 recordings, playing time 26\u00a0s");
  });

  it("compares the duration with the timer", () => {
    expect(describeTimer(null, 5000)).toBeNull();
    expect(describeTimer(2, 120)).toBeNull();
    expect(describeTimer(1, 120)).toContain(
      "Playing takes 2\u00a0min. After 1\u00a0minute of playing no further recording",
    );
  });
});

describe("the changes between two versions", () => {
  it("are listed by recording", () => {
    const before = version([item("Lift"), item("Turn"), item("Reach")]);
    const after = version([
      item("Lift", { range_percent: 80, resistance_level: 5 }),
      item("Reach"),
      item("Hold"),
    ]);
    expect(changes(before, after)).toEqual([
      "Turn removed",
      "Lift: range 80\u00a0% instead of 100\u00a0%, resistance level 5 instead of 8",
      "Hold added: as taught, once; resistance level 8\u00a0of\u00a025",
    ]);
  });

  it("include the prescribed end-range time", () => {
    const end_range = { motion: 4, minutes: 5, band_deg: 10, torque_nm: 0.5 };
    const [without, five, two] = [null, end_range, { ...end_range, minutes: 2 }].map((prescribed) =>
      version([item("Lift", { end_range: prescribed })]),
    ) as [ProgrammeVersion, ProgrammeVersion, ProgrammeVersion];
    const words = (minutes: number) =>
      `end-range time of Abduction / adduction of the shoulder ${minutes}\u00a0min per session (last 10°, at least 0.5\u00a0Nm)`;
    expect(changes(without, five)).toEqual([`Lift: ${words(5)}`]);
    expect(changes(five, two)).toEqual([`Lift: ${words(2)} instead of ${words(5)}`]);
    expect(changes(two, without)).toEqual(["Lift: end-range time removed"]);
    expect(changes(five, five)).toEqual(["Playback unchanged"]);
  });

  it("include the pace", () => {
    const [own, patients] = [false, true].map((self_paced) => version([item("Lift", { self_paced })])) as [
      ProgrammeVersion,
      ProgrammeVersion,
    ];
    expect(describeItem(item("Lift", { self_paced: true }))).toBe(
      "As taught, once; the patient sets the pace; resistance level 8\u00a0of\u00a025",
    );
    expect(changes(own, patients)).toEqual(["Lift: pace of the patient instead of of the recording"]);
  });

  it("include order, timer and frequency", () => {
    const before = version([item("Lift"), item("Turn")], { timer_minutes: 20 });
    const after = version([item("Turn", { method: "learned" }), item("Lift")], { sessions_per_week: 1 });
    expect(changes(before, after)).toEqual([
      "Turn: playback method learned instead of smooth",
      "Order changed",
      "Timer of 20\u00a0minutes removed",
      "Goal set to 1\u00a0session per week",
    ]);
    expect(changes(version([], { timer_minutes: 20 }), version([], { timer_minutes: 15 }))).toEqual([
      "Timer 15\u00a0minutes instead of 20",
    ]);
  });

  it("match repeated recordings by order", () => {
    const twice = version([item("Lift"), item("Lift", { speed_percent: 50 })]);
    const once = version([item("Lift", { speed_percent: 50 })]);
    expect(changes(twice, once)).toEqual(["Lift (2) removed", "Lift: speed 50\u00a0% instead of 100\u00a0%"]);
    expect(changes(twice, twice)).toEqual(["Playback unchanged"]);
  });
});
