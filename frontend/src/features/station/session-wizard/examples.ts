import type { Schemas } from "../../../lib/api/client";
import type { SessionState } from "./steps";

export const PATIENT: Schemas["PatientIdentity"] = {
  name: "Yamada Hanako",
  kana: "ヤマダ ハナコ",
  birth_date: "1968-04-12",
  clinic_number: "K-1",
};

/** A session that has just begun. */
export const FRESH: SessionState = {
  ended_at: null,
  checks: [],
  pain_before: null,
  pain_during: null,
  pain_after: null,
  runs: [],
};
