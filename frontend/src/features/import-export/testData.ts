import type { Patient, Schemas } from "../../lib/api/client";

/** Data of tests. */
export const PATIENT = { id: "p", name: "Yamada Hanako", clinic_number: "K-7", erased_at: null } as Patient;
export const UNDERSTOOD: Schemas["UnderstoodMotion"] = {
  layout: "poses",
  separator: "comma",
  left_alone: ["remark"],
  side: "left",
  samples: 401,
  duration_s: 4,
  rate_hz: 100,
  ranges: [{ motor: 3, min_deg: 10, max_deg: 90, max_speed_deg_s: 31 }],
  margin: {
    margin_deg: 12.5,
    at_s: 3.2,
    quantity: "plane of elevation",
    quantity_key: null,
    value_deg: 117.5,
    limit_deg: 130,
  },
  simulated: true,
};
export const ERASURE: Schemas["Erasure"] = {
  id: "e",
  patient_id: "p",
  asked_at: "2026-11-21T09:30:00Z",
  reason: "By letter",
  noted_by: "Ito Mai",
  decided_at: null,
  decided_by: "",
  decision: null,
  explanation: "",
};
