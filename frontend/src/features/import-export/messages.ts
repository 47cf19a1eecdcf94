import type { Schemas } from "../../lib/api/client";
import { sideWord } from "../../lib/format";
import { say } from "../../lib/language";

type Side = "left" | "right";

/** What leaves and enters a patient's record. */
export const DATA = say(
  {
    title: "Data",
    erased: "What told who this is was erased. What the shoulder did stays, without a person.",
    everything: "Everything (ZIP)",
    otherSystems: "For other systems (FHIR)",
    motion: "Motion from a CSV file",
  },
  {
    title: "データ",
    erased: "個人を特定できる情報は消去されました。肩の動作の記録は、匿名の形で残ります。",
    everything: "すべてのデータ（ZIP）",
    otherSystems: "他システム用（FHIR）",
    motion: "CSVファイルから動作を取り込む",
  },
);

/** A file that is read in, and what is wrong in it. */
export const FILE = say(
  {
    choose: "Choose a file",
    wrong: (places: number) =>
      places === 1 ? "One thing is wrong in this file" : `${places} things are wrong in this file`,
    place: (where: string) => `${where}:`,
    csv: "CSV",
    parquet: "Parquet",
  },
  {
    choose: "ファイルを選択",
    wrong: (places) => `このファイルに誤りが${places}か所あります`,
    place: (where) => `${where}：`,
    csv: "CSV",
    parquet: "Parquet",
  },
);

/** A motion from a file. */
export const MOTION = say(
  {
    layout:
      "A CSV file in UTF-8 with a first line of names: time_s and the five angles of the arm (scapula_abduction, scapula_upward_rotation, shoulder_abduction, shoulder_flexion, external_rotation), or motor_1_deg to motor_5_deg as recordings are downloaded here. Seconds and degrees.",
    shoulder: "Shoulder",
    sides: { left: "Left shoulder", right: "Right shoulder" },
    file: "CSV file",
    name: "Name of the recording",
    keep: "Keep as a recording",
    understood: (told: {
      layout: Schemas["UnderstoodMotion"]["layout"];
      rows: number;
      hz: number;
      duration: string;
      side: Side;
    }) =>
      `${told.layout === "poses" ? "Angles of the arm" : "Angles of the motors"}, ${told.rows} rows at ${told.hz} Hz, ${told.duration} long, for the ${told.side} shoulder.`,
    leftAlone: (columns: string[]) => ` Left alone: ${columns.join(", ")}.`,
  },
  {
    layout:
      "UTF-8のCSVファイル。1行目に列名が必要です。time_s と腕の5つの角度（scapula_abduction、scapula_upward_rotation、shoulder_abduction、shoulder_flexion、external_rotation）、または記録動作のダウンロードと同じ motor_1_deg 〜 motor_5_deg。単位は秒と度です。",
    shoulder: "肩",
    sides: { left: "左肩", right: "右肩" },
    file: "CSVファイル",
    name: "記録動作の名前",
    keep: "記録動作として保存",
    understood: (told) =>
      `${told.layout === "poses" ? "腕の角度" : "モータの角度"}、${told.rows}行、${told.hz} Hz、長さ ${told.duration}、${sideWord(told.side)}肩用。`,
    leftAlone: (columns) => `使用しない列：${columns.join("、")}。`,
  },
);

/** Patients from a file. */
export const FHIR = say(
  {
    open: "Import",
    title: "Import patients from FHIR",
    means:
      "A FHIR R4 Patient, or a Bundle with Patients. All of them are signed up, or none. No record that is there already is changed.",
    file: "FHIR file",
    treated: "Shoulder that is treated",
    sides: { left: "Left shoulder is treated", right: "Right shoulder is treated" },
    signedUp: "Signed up:",
    numbered: (number: string) => `, ${number}`,
    leftOut: (told: string[]) => `Not kept here: ${told.join(", ")}.`,
  },
  {
    open: "取り込み",
    title: "FHIRから患者を取り込む",
    means:
      "FHIR R4のPatient、またはPatientを含むBundle。全員を登録するか、誰も登録しないかのどちらかです。既にある記録は変更しません。",
    file: "FHIRファイル",
    treated: "治療する肩",
    sides: { left: "左肩を治療", right: "右肩を治療" },
    signedUp: "登録した患者：",
    numbered: (number) => `（${number}）`,
    leftOut: (told) => `取り込まなかった項目：${told.join("、")}。`,
  },
);

/** A patient asks for the record to be erased. */
export const ERASURE = say(
  {
    open: "Requests for erasure to be decided",
    askedOn: (moment: string) => `Asked for on ${moment}`,
    decide: "Decide on the erasure",
    administratorDecides: "An administrator decides on it.",
    ask: "Patient asks for erasure",
    asking: "The patient asks for the record to be erased",
    noted: "This is noted. Nothing is erased before somebody has decided it.",
    how: "How and why it was asked for",
    note: "Note the request",
    explanation: "Explanation",
    explanationMeans: "Needed for a refusal: a duty to keep records, say. Do not name the patient.",
    refuse: "Refuse, keep the record",
    erasing:
      "Erasing takes away name, reading, birth date, clinic number and every note. Nothing brings them back. What was measured stays, without a person. Copies in backups are not touched.",
    typeNumber: (name: string) => `To erase, type the clinic number of ${name}`,
    erase: "Erase for good",
    request: (moment: string, by: string, reason: string) =>
      `Erasure asked for on ${moment}, noted by ${by}${reason && `: ${reason}`}`,
    erased: (request: string, by: string, explanation: string) =>
      `${request}. Erased by ${by}${explanation && `: ${explanation}`}`,
    refused: (request: string, by: string, explanation: string) =>
      `${request}. Refused by ${by}${explanation && `: ${explanation}`}`,
  },
  {
    open: "未決定の消去依頼",
    askedOn: (moment) => `${moment}の依頼`,
    decide: "消去の可否を決定",
    administratorDecides: "管理者が決定します。",
    ask: "患者からの消去依頼",
    asking: "患者からの記録消去の依頼",
    noted: "依頼を記録します。決定されるまで、何も消去されません。",
    how: "依頼の方法と理由",
    note: "依頼を記録",
    explanation: "説明",
    explanationMeans: "拒否する場合は必須です（記録の保存義務など）。患者名は書かないでください。",
    refuse: "拒否して記録を残す",
    erasing:
      "消去すると、氏名、フリガナ、生年月日、患者番号、すべての備考と所見が失われ、元に戻せません。測定値は匿名の形で残ります。バックアップ内の複製は消去されません。",
    typeNumber: (name) => `消去するには、${name}さんの患者番号を入力してください`,
    erase: "完全に消去",
    request: (moment, by, reason) => `消去の依頼：${moment}（記入者：${by}）${reason && `　${reason}`}`,
    erased: (request, by, explanation) =>
      `${request}　消去済み（決定者：${by}）${explanation && `　${explanation}`}`,
    refused: (request, by, explanation) =>
      `${request}　拒否（決定者：${by}）${explanation && `　${explanation}`}`,
  },
);
