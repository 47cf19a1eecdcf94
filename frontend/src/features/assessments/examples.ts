import type { Assessment, Schemas } from "../../lib/api/client";

/** Example data for tests. */
export const FORM: Schemas["AssessmentForm"] = {
  rom: [
    measure("flexion", "", "Flexion", -20, 200, 180),
    measure("extension", "", "Extension", -30, 90, 50),
    measure("external_rotation", "at_side", "External rotation, arm at the side", -60, 120, 60),
    measure("external_rotation", "flexed_90", "External rotation, arm flexed 90°", -60, 130, 25, {
      adds_deg: 90,
      fits_from_deg: 45,
    }),
    measure("internal_rotation", "flexed_90", "Internal rotation, arm flexed 90°", -60, 120, 80, {
      adds_deg: -90,
      fits_from_deg: 35,
    }),
  ],
  spadi: Array.from({ length: 13 }, (_, place) => ({
    subscale: place < 5 ? "pain" : "disability",
    text: `Item ${place + 1}`,
    text_ja: `項目${place + 1}`,
  })),
  spadi_mcid_lower: 8,
  spadi_mcid_upper: 13,
  spadi_mdc: 17,
};

export const ASSESSMENT: Assessment = {
  id: "a",
  episode_id: "e",
  assessed_at: "2026-03-09T09:30:25Z",
  assessed_by: "Kimura Jun",
  rom: [
    angle("left", "flexion", "active", 105),
    angle("left", "flexion", "passive", 120),
    angle("right", "flexion", "active", 175),
    angle("left", "external_rotation", "active", -5, "at_side"),
  ],
  pain_rest: 2,
  pain_active: null,
  pain_passive: null,
  pain_average: 5,
  spadi: [6, 6, 6, 6, 6, 3, 3, 3, 3, 3, 3, 3, 3],
  questionnaires: [],
  spadi_score: { pain: 60, disability: 30, total: 45 },
  note: "Slept through.",
  updated_at: "2026-03-09T09:40:00Z",
  withdrawn_at: null,
};

/** One week before ASSESSMENT. */
export const BASELINE: Assessment = {
  ...ASSESSMENT,
  id: "b",
  assessed_at: "2026-03-02T09:30:00Z",
  rom: [angle("left", "flexion", "active", 90), angle("left", "external_rotation", "active", -5, "at_side")],
  pain_rest: 4,
  spadi_score: { pain: 70, disability: 40, total: 55 },
};

function measure(
  motion: Schemas["RomMeasure"]["motion"],
  position: Schemas["RomMeasure"]["position"],
  name: string,
  lowest_deg: number,
  highest_deg: number,
  reference_deg: number,
  other_zero: Schemas["RomZero"] | null = null,
): Schemas["RomMeasure"] {
  return { motion, position, name, name_ja: name, lowest_deg, highest_deg, reference_deg, other_zero };
}

function angle(
  side: Schemas["RomEntry"]["side"],
  motion: Schemas["RomEntry"]["motion"],
  kind: Schemas["RomEntry"]["kind"],
  angle_deg: number,
  position: Schemas["RomEntry"]["position"] = "",
): Schemas["RomEntry"] {
  return { side, motion, position, kind, angle_deg };
}
