import { describe, expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { type ArmPoint, type LiveMotion, leadOf, pointOf, type SoundMotion, withPoint } from "./liveRhythm";

const ELEVATIONS = Array.from({ length: 90 }, (_, n) => 12.5 + n);
const RATIO_BAND = {
  from_deg: 30,
  to_deg: 60,
  ratio: 4,
  reason: null,
  scapula_deg: 6,
  joint_deg: 24,
  passes: 1,
};

/** The sound side's scapula turns by a fifth of the elevation from 12 degrees on. */
function sound(given: Partial<Schemas["RhythmCurve"]> = {}, start_elevation_deg = 12): SoundMotion {
  const curve: Schemas["RhythmCurve"] = {
    of: "sound",
    direction: "raising",
    plane: "abduction",
    plane_deg: 0,
    passes: 1,
    elevation_deg: ELEVATIONS,
    scapula_deg: ELEVATIONS.map((deg) => (deg - 12) / 5),
    bands: [RATIO_BAND],
    whole: RATIO_BAND,
    reference: null,
    ...given,
  };
  const recording = {
    recording_id: "s",
    name: "Sound",
    side: "right" as const,
    taught_at: "2026-11-01T09:00:00Z",
  };
  return { recording, start_elevation_deg, start_scapula_deg: 0, curves: [curve] };
}

const START = { motion_id: "run", start_elevation_deg: 12, start_scapula_deg: 3, curves: [] };

/** A point whose scapula is this far ahead of the sound side's. */
const point = (elevation_deg: number, ahead_deg: number, plane_deg = 0): ArmPoint => ({
  elevation_deg,
  scapula_deg: (elevation_deg - 12) / 5 + 3 + ahead_deg,
  plane_deg,
});

/** Follow points one after the other. */
const followed = (points: ArmPoint[], motions = [sound()], from: LiveMotion | null = null) =>
  points.reduce<LiveMotion | null>((motion, one) => withPoint(motion, one, START, motions), from);

const raised = (ahead: (deg: number) => number, from = 12, to = 55) =>
  Array.from({ length: to - from + 1 }, (_, n) => point(from + n, ahead(from + n)));

it("agrees with kata.motion.shoulder about elevation and plane", () => {
  expect(pointOf([0, 10, 60, 0, 0])).toMatchObject({ elevation_deg: expect.closeTo(70, 6), scapula_deg: 10 });
  expect(pointOf([0, 10, 60, 0, 0]).plane_deg).toBeCloseTo(0, 6);
  expect(pointOf([0, 0, 0, 80, 30])).toMatchObject({
    elevation_deg: expect.closeTo(80, 6),
    plane_deg: expect.closeTo(90, 6),
  });
  // The scapula's abduction turns the raised arm forward.
  expect(pointOf([15, 0, 90, 0, 0]).plane_deg).toBeCloseTo(15, 6);
});

describe("the lead over the sound side", () => {
  it("is the difference since the start of both motions", () => {
    expect(leadOf(point(50, 5), START, [sound()])).toBeCloseTo(5, 6);
    expect(leadOf(point(50, -2), START, [sound()])).toBeCloseTo(-2, 6);
  });

  it.each([
    ["below 30 degrees", point(29, 9), START, [sound()]],
    ["in another plane", point(50, 9, 40), START, [sound()]],
    ["above the sound side's motion", point(110, 0), START, [sound()]],
    ["at the apparatus' limit", point(50, 9.5), START, [sound()]],
    ["after a start with a raised arm", point(50, 9), { ...START, start_elevation_deg: 40 }, [sound()]],
    ["if the sound side started raised", point(50, 9), START, [sound({}, 40)]],
    ["while the sound side was lowered", point(50, 9), START, [sound({ direction: "lowering" })]],
    ["without the sound side", point(50, 9), START, []],
  ])("is unknown %s", (_, arm, start, motions) => {
    expect(leadOf(arm, start, motions)).toBeNull();
  });
});

describe("a scapula that runs ahead", () => {
  it("is noticed where it is ahead by more than 4 degrees, with the largest lead", () => {
    const motion = followed(raised((deg) => (deg - 12) / 8));
    expect(motion).toMatchObject({ ahead: true, direction: "raising" });
    expect(motion?.largest).toMatchObject({ elevation_deg: 55, lead_deg: expect.closeTo(5.375, 6) });
    expect(followed(raised((deg) => (deg - 12) / 8, 12, 43))?.ahead).toBe(false);
    expect(followed(raised((deg) => (deg - 12) / 8, 12, 45))?.ahead).toBe(true);
  });

  it("is not noticed beside the same rhythm", () => {
    expect(followed(raised(() => 0))).toMatchObject({
      ahead: false,
      largest: null,
      lead_deg: expect.closeTo(0, 6),
    });
  });

  it("stays noticed at the threshold without flickering", () => {
    const before = followed(raised((deg) => (deg > 40 ? 4.5 : 0), 12, 50));
    expect(followed([point(51, 3.5)], [sound()], before)?.ahead).toBe(true);
    expect(followed([point(51, 2.9)], [sound()], before)?.ahead).toBe(false);
  });

  it("is not judged while the arm is lowered", () => {
    const up = followed(raised(() => 6));
    expect(up?.ahead).toBe(true);
    const down = followed(raised(() => 6, 40, 54).toReversed(), [sound()], up);
    expect(down).toMatchObject({ direction: "lowering", lead_deg: null, ahead: false });
    expect(down?.largest?.lead_deg).toBeCloseTo(6, 6);
  });

  it("is forgotten when another motion begins", () => {
    const next = withPoint(followed(raised(() => 6)), point(12, 0), { ...START, motion_id: "next" }, [
      sound(),
    ]);
    expect(next).toMatchObject({ id: "next", largest: null, direction: null });
    expect(next.trail).toHaveLength(1);
  });
});
