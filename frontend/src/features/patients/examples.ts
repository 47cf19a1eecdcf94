import type { Schemas } from "../../lib/api/client";

export const FRACTURE: Schemas["Contraindication"] = {
  id: "c1",
  patient_id: "p",
  episode_id: "e",
  side: "left",
  code: "fracture",
  scope: "episode",
  effect: "block",
  name: "Fracture that has not united",
  source: "Kisner and Colby",
  note: "",
  noted_at: "2026-11-01T09:00:00Z",
  noted_by: "Ito Mai",
  signed_off_at: null,
  signed_off_by: "",
  resolved_at: null,
  resolved_by: "",
  resolution: "",
  stops_motion: true,
};

export const REPAIR: Schemas["Contraindication"] = {
  ...FRACTURE,
  id: "c2",
  code: "recent_repair",
  effect: "sign_off",
  name: "Recent repair of tendon, ligament or capsule",
};

export const BANNER: Schemas["PatientBanner"] = {
  patient_id: "p",
  name: "Yamada Hanako",
  kana: "ヤマダ ハナコ",
  birth_date: "1968-04-12",
  age_years: 58,
  clinic_number: "K-0042",
  shoulders: [
    {
      episode_id: "e",
      side: "left",
      stage: "freezing",
      stage_since: "2026-08-01",
      contraindications: "No traction.",
      proposal: {
        stage: "freezing",
        resistance_level: 8,
        speed_percent: 50,
        range_percent: 80,
        repetitions: 5,
        source: "Kelley et al.",
      },
    },
  ],
  contraindications: [FRACTURE],
};
