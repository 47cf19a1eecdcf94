import { sideWord } from "../../lib/format";
import { say } from "../../lib/language";

export const PATIENT = say(
  {
    title: "Patient",
    toStation: "To the station",
    edit: "Edit",
    editing: "Edit patient",
    archive: "Archive",
    restore: "Restore",
    archived: "Archived",
    erased: "Erased",
    number: (number: string) => `Clinic number ${number}`,
    handed: (side: "left" | "right") => `${sideWord(side)}-handed`,
    born: (day: string) => `Born ${day}`,
    sessions: "Sessions",
  },
  {
    title: "患者",
    toStation: "ステーションへ",
    edit: "編集",
    editing: "患者情報の編集",
    archive: "アーカイブする",
    restore: "元に戻す",
    archived: "アーカイブ済み",
    erased: "消去済み",
    number: (number) => `患者番号 ${number}`,
    handed: (side) => `${sideWord(side)}利き`,
    born: (day) => `${day}生まれ`,
    sessions: "セッション",
  },
);

/** What was taught to the patient's shoulder. */
export const RECORDINGS = say(
  {
    title: "Recordings",
    none: "Nothing has been taught yet. Teach a motion at the station.",
    name: "Name",
    taught: "Taught or made",
    side: "Side",
    length: "Length",
    archived: " (archived)",
  },
  {
    title: "記録動作",
    none: "教示はまだ行われていません。ステーションで動作を教示してください。",
    name: "名前",
    taught: "教示・作成日時",
    side: "側",
    length: "長さ",
    archived: "（アーカイブ済み）",
  },
);
