import type { Schemas } from "../../../lib/api/client";

export const PATIENT: Schemas["PatientIdentity"] = {
  name: "Yamada Hanako",
  kana: "ヤマダ ハナコ",
  birth_date: "1968-04-12",
  clinic_number: "K-1",
};
