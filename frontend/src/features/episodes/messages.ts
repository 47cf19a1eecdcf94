import type { Episode } from "../../lib/api/client";
import { sideWord } from "../../lib/format";
import { say } from "../../lib/language";

export type Side = Episode["side"];

const MOTION_NAMES = say<readonly [string, string, string, string, string, string]>(
  [
    "Abduction / adduction of the scapula",
    "Upward / downward rotation of the scapula",
    "Horizontal flexion / extension of the shoulder",
    "Abduction / adduction of the shoulder",
    "Flexion / extension of the shoulder",
    "External / internal rotation of the shoulder",
  ],
  [
    "肩甲骨の外転・内転",
    "肩甲骨の上方回旋・下方回旋",
    "肩関節の水平屈曲・水平伸展",
    "肩関節の外転・内転",
    "肩関節の屈曲・伸展",
    "肩関節の外旋・内旋",
  ],
);

/** Table 2: the six basic motions, and how far the apparatus takes each of them. */
export const MOTIONS = [
  { motion: 1, name: MOTION_NAMES[0], from: -20, to: 20 },
  { motion: 2, name: MOTION_NAMES[1], from: -20, to: 20 },
  { motion: 3, name: MOTION_NAMES[2], from: -20, to: 130 },
  { motion: 4, name: MOTION_NAMES[3], from: 0, to: 120 },
  { motion: 5, name: MOTION_NAMES[4], from: -20, to: 190 },
  { motion: 6, name: MOTION_NAMES[5], from: -90, to: 40 },
] as const;

export type StageName = NonNullable<Episode["stage"]>["stage"];

export const STAGES = say<Record<StageName, string>>(
  { freezing: "Freezing", frozen: "Frozen", thawing: "Thawing" },
  { freezing: "炎症期", frozen: "拘縮期", thawing: "回復期" },
);

/** The episodes of a patient's shoulders. */
export const CARE = say(
  {
    title: "Care",
    open: (side: Side) => `Open an episode of the ${side} shoulder`,
    none: "No episode of care is open: nothing can be played to this patient until one is.",
    past: "Past episodes",
    opening: (side: Side) => `New episode of the ${side} shoulder`,
    episode: (side: Side) => `Episode of the ${side} shoulder`,
    shoulder: (side: Side) => `${sideWord(side)} shoulder`,
    diagnosed: (shoulder: string, diagnosis: string) => `${shoulder}: ${diagnosis}`,
    closed: "Closed",
    reopen: "Reopen",
    change: "Change",
    close: "Close episode",
    closing: (shoulder: string) => `Close: ${shoulder}`,
    noStage: "No stage noted",
    onset: (day: string) => `Onset ${day}`,
    since: (opened: string) => `Opened ${opened}`,
    fromTo: (opened: string, closed: string) => `Opened ${opened}, closed ${closed}`,
    contraindications: (told: string) => `Contraindications: ${told}`,
    allowedBy: (doctor: string) => `Allowed by ${doctor}`,
    levelAtMost: (level: number) => `Resistance level ${level} at most`,
    speedAtMost: (degPerSecond: number) => `No motor faster than ${degPerSecond} deg/s`,
    closingNote: (note: string) => `Closing note: ${note}`,
    closingMeans: "Nothing is played to this shoulder afterwards, until an episode of it is open again.",
    closingNoteLabel: "Closing note",
  },
  {
    title: "治療",
    open: (side) => `${sideWord(side)}肩の治療エピソードを開始`,
    none: "継続中の治療エピソードがありません。開始するまで、この患者には再生できません。",
    past: "過去の治療エピソード",
    opening: (side) => `${sideWord(side)}肩の新しい治療エピソード`,
    episode: (side) => `${sideWord(side)}肩の治療エピソード`,
    shoulder: (side) => `${sideWord(side)}肩`,
    diagnosed: (shoulder, diagnosis) => `${shoulder}：${diagnosis}`,
    closed: "終了",
    reopen: "再開",
    change: "変更",
    close: "治療エピソードを終了",
    closing: (shoulder) => `治療エピソードの終了（${shoulder}）`,
    noStage: "病期の記録なし",
    onset: (day) => `発症日 ${day}`,
    since: (opened) => `開始 ${opened}`,
    fromTo: (opened, closed) => `開始 ${opened}、終了 ${closed}`,
    contraindications: (told) => `禁忌：${told}`,
    allowedBy: (doctor) => `許容範囲（指示医：${doctor}）`,
    levelAtMost: (level) => `抵抗許容レベルは${level}まで`,
    speedAtMost: (degPerSecond) => `モータの速度は毎秒${degPerSecond}°まで`,
    closingNote: (note) => `終了時の所見：${note}`,
    closingMeans: "終了すると、治療エピソードを再び開始するまで、この肩には再生できません。",
    closingNoteLabel: "終了時の所見",
  },
);

/** The form of an episode. */
export const FORM = say(
  {
    diagnosis: "Diagnosis",
    onset: "Onset",
    contraindications: "Contraindications",
    allowed: "What the doctor allows",
    allowedMeans:
      "What goes further is refused before it is played. Without a number, the apparatus' own range holds.",
    motion: "Motion, and the apparatus' range",
    lowest: "No less than",
    highest: "No more than",
    lowestOf: (motion: string) => `${motion}: no less than`,
    highestOf: (motion: string) => `${motion}: no more than`,
    fromTo: (lowest: string, highest: string) => `${lowest} to ${highest} deg`,
    deg: " deg",
    free: "Free",
    level: "Highest resistance level",
    speed: "Highest speed",
    speedMeans: "1 to 150 deg/s, of every motor, on the way to the start and back too",
    degPerSecond: " deg/s",
    any: "Any",
    doctor: "Doctor who set the limits",
    save: "Save",
    open: "Open episode",
  },
  {
    diagnosis: "診断名",
    onset: "発症日",
    contraindications: "禁忌",
    allowed: "医師による制限",
    allowedMeans: "この範囲を超える動作は、再生前に拒否されます。入力がなければ装置の可動範囲に従います。",
    motion: "運動（装置の可動範囲）",
    lowest: "下限",
    highest: "上限",
    lowestOf: (motion) => `${motion}：下限`,
    highestOf: (motion) => `${motion}：上限`,
    fromTo: (lowest, highest) => `${lowest}° 〜 ${highest}°`,
    deg: "°",
    free: "制限なし",
    level: "抵抗許容レベルの上限",
    speed: "速度の上限",
    speedMeans: "1〜150°/s。開始位置への移動と戻りを含む、すべてのモータの速度",
    degPerSecond: "°/s",
    any: "制限なし",
    doctor: "制限を指示した医師",
    save: "保存",
    open: "治療エピソードを開始",
  },
);

/** The stages of an episode. */
export const NOTED = say(
  {
    title: "Stages",
    none: "None noted yet.",
    since: (stage: StageName, day: string) => `${STAGES[stage]} since ${day}`,
    remove: (stage: StageName, day: string) => `Remove ${STAGES[stage]} since ${day}`,
    newStage: "New stage",
    day: "Since",
    add: "Note stage",
  },
  {
    title: "病期",
    none: "まだ記録がありません。",
    since: (stage, day) => `${STAGES[stage]}（${day}から）`,
    remove: (stage, day) => `${STAGES[stage]}（${day}から）を削除`,
    newStage: "新しい病期",
    day: "開始日",
    add: "病期を記録",
  },
);

const LIMITS = say(
  {
    unknownMotion: (motion: number) => `Motion ${motion}`,
    atMost: (motion: string, highest: string) => `${motion}: no more than ${highest} deg`,
    atLeast: (motion: string, lowest: string) => `${motion}: no less than ${lowest} deg`,
    between: (motion: string, lowest: string, highest: string) => `${motion}: ${lowest} to ${highest} deg`,
  },
  {
    unknownMotion: (motion) => `運動${motion}`,
    atMost: (motion, highest) => `${motion}：${highest}°以下`,
    atLeast: (motion, lowest) => `${motion}：${lowest}°以上`,
    between: (motion, lowest, highest) => `${motion}：${lowest}°〜${highest}°`,
  },
);

/** A whole angle with a true minus sign. */
export const minus = (value: number) => String(value).replace("-", "−");

/** "Abduction / adduction of the shoulder: 0 to 90 deg", or only one end of it. */
export function limitWords({ motion, lowest_deg, highest_deg }: Episode["limits"][number]): string {
  const name = MOTIONS.find((one) => one.motion === motion)?.name ?? LIMITS.unknownMotion(motion);
  if (lowest_deg === null || lowest_deg === undefined) return LIMITS.atMost(name, minus(highest_deg ?? 0));
  if (highest_deg === null || highest_deg === undefined) return LIMITS.atLeast(name, minus(lowest_deg));
  return LIMITS.between(name, minus(lowest_deg), minus(highest_deg));
}

/** Today in this browser, as 2026-11-21. */
export function today(now = new Date()): string {
  const two = (value: number) => String(value).padStart(2, "0");
  return `${now.getFullYear()}-${two(now.getMonth() + 1)}-${two(now.getDate())}`;
}
