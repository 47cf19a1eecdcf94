import type { Patient } from "../../lib/api/client";
import { say } from "../../lib/language";

type Side = "left" | "right";

export const PATIENTS = say(
  {
    title: "Patients",
    add: "New patient",
    search: "Search",
    searchedBy: "Any parts of name, kana, clinic number and birth date, such as “sato 1968-04”",
    archived: "Archived",
    nobodyMatches: "Nobody matches.",
    nobodyYet: "Nobody is signed up yet. It begins with “New patient”.",
    name: "Name",
    number: "Clinic number",
    born: "Born",
    shoulder: "Shoulder",
  },
  {
    title: "患者",
    add: "新しい患者",
    search: "検索",
    searchedBy: "氏名、フリガナ、患者番号、生年月日の一部（例：「さとう 1968-04」）",
    archived: "アーカイブ済み",
    nobodyMatches: "該当する患者はいません。",
    nobodyYet: "登録された患者はまだいません。「新しい患者」から始めてください。",
    name: "氏名",
    number: "患者番号",
    born: "生年月日",
    shoulder: "治療側",
  },
);

/** The form of a patient's record. */
export const FORM = say(
  {
    name: "Name",
    kana: "Reading of the name (kana)",
    number: "Clinic number",
    treated: "Shoulder that is treated",
    chooseSide: "Choose left or right.",
    birthDate: "Birth date",
    sex: "Sex",
    dominant: "Dominant side",
    notStated: "Not stated",
    notes: "Notes",
    save: "Save",
    signUp: "Sign up",
  },
  {
    name: "氏名",
    kana: "フリガナ",
    number: "患者番号",
    treated: "治療する肩",
    chooseSide: "左か右を選んでください。",
    birthDate: "生年月日",
    sex: "性別",
    dominant: "利き手",
    notStated: "記載なし",
    notes: "備考",
    save: "保存",
    signUp: "登録",
  },
);

export const SEXES = say<Record<Patient["sex"], string>>(
  { unknown: "Not stated", female: "Female", male: "Male", other: "Other" },
  { unknown: "記載なし", female: "女性", male: "男性", other: "その他" },
);

export const SIDES = say<Record<Side, string>>({ left: "Left", right: "Right" }, { left: "左", right: "右" });

/** Choosing one of all patients. */
export const CHOICE = say(
  {
    label: "Patient",
    who: "Who is on the apparatus?",
    nobodyYet: "Sign a patient up first, under Patients",
    nobodyMatches: "Nobody matches",
    one: (name: string, number: string) => `${name} (${number})`,
  },
  {
    label: "患者",
    who: "装置を使う患者",
    nobodyYet: "先に「患者」で患者を登録してください",
    nobodyMatches: "該当なし",
    one: (name, number) => `${name}（${number}）`,
  },
);
