import type { Schemas } from "../../lib/api/client";
import { formatDeg, sideWord } from "../../lib/format";
import { say } from "../../lib/language";
import type { Kind, Pain, Side } from "./draft";

/** A score of 0 to 100; a dash where there is none. */
export const formatScore = (value: number | null | undefined) => formatDeg(value, 0);

/** What a motion that is measured is called, and an item of the questionnaire; the service has both languages. */
export const measureName = say<(one: Schemas["RomMeasure"]) => string>(
  ({ name }) => name,
  ({ name_ja }) => name_ja,
);
export const itemName = say<(one: Schemas["SpadiItem"]) => string>(
  ({ text }) => text,
  ({ text_ja }) => text_ja,
);

export const KINDS = say<Record<Kind, string>>(
  { active: "Active", passive: "Passive" },
  { active: "自動", passive: "他動" },
);

export const PAINS = say<Record<Pain, string>>(
  {
    pain_rest: "At rest",
    pain_active: "Moving the arm",
    pain_passive: "Being moved",
    pain_average: "Average of the last week",
  },
  {
    pain_rest: "安静時",
    pain_active: "自動運動時",
    pain_passive: "他動運動時",
    pain_average: "この1週間の平均",
  },
);

/** What was found, and a list of it. */
export const ASSESSMENTS = say(
  {
    title: "Assessments",
    progress: "Progress",
    add: "New assessment",
    none: "Nothing has been assessed yet.",
    all: "All assessments",
    hide: "Hide the list",
    found: (moment: string, by: string) => `${moment}, ${by}`,
    foundSince: (moment: string, by: string, first: string) =>
      `${moment}, ${by}; in brackets, what has changed since ${first}`,
    otherShoulder: (side: Side, said: string[]) => `${sideWord(side)} shoulder: ${said.join("; ")}`,
    when: "When",
    by: "By",
    angles: "Angles",
    averagePain: "Average pain",
    spadi: "SPADI",
    withdrawn: "Withdrawn, entered by mistake",
    keep: "Keep",
    withdrawSurely: "Withdraw: entered by mistake",
    change: "Change",
    withdraw: "Withdraw",
  },
  {
    title: "評価",
    progress: "経過",
    add: "新しい評価",
    none: "評価はまだ行われていません。",
    all: "すべての評価",
    hide: "一覧を閉じる",
    found: (moment, by) => `${moment}　${by}`,
    foundSince: (moment, by, first) => `${moment}　${by}（かっこ内は初回 ${first} からの変化）`,
    otherShoulder: (side, said) => `${sideWord(side)}肩：${said.join("；")}`,
    when: "日時",
    by: "評価者",
    angles: "測定数",
    averagePain: "平均疼痛",
    spadi: "SPADI",
    withdrawn: "誤入力のため取り下げ済み",
    keep: "取り下げない",
    withdrawSurely: "誤入力として取り下げる",
    change: "変更",
    withdraw: "取り下げ",
  },
);

/** The form of an assessment. */
export const FORM = say(
  {
    add: "New assessment",
    change: "Change assessment",
    when: "When",
    by: "Assessed by",
    rom: "Range of motion",
    pain: "Pain",
    spadi: "SPADI",
    painScale: "0 is none, 10 the worst imaginable. Touch a number again to take it back.",
    note: "Note",
    discard: "Discard",
    save: "Save assessment",
  },
  {
    add: "新しい評価",
    change: "評価の変更",
    when: "評価日時",
    by: "評価者",
    rom: "関節可動域",
    pain: "痛み",
    spadi: "SPADI",
    painScale: "0は痛みなし、10は想像できる最大の痛み。同じ数字をもう一度押すと取り消します。",
    note: "所見",
    discard: "破棄",
    save: "評価を保存",
  },
);

/** The table of angles. */
export const ROM = say(
  {
    title: "Range of motion",
    degrees: "Degrees",
    side: (side: Side) => sideWord(side),
    affected: (side: Side) => `${sideWord(side)} (affected)`,
    reference: "Reference",
    cell: (measure: string, side: Side, kind: Kind) => `${measure}, ${side}, ${kind}`,
    implausible: (measure: string, lowest: string, highest: string) =>
      `${measure} is between ${lowest} and ${highest} degrees.`,
    more: "More motions: rotation with the arm raised, adduction, scapula",
  },
  {
    title: "関節可動域",
    degrees: "単位：度",
    side: (side) => sideWord(side),
    affected: (side) => `${sideWord(side)}（患側）`,
    reference: "参考値",
    cell: (measure, side, kind) => `${measure}、${sideWord(side)}、${KINDS[kind]}`,
    implausible: (measure, lowest, highest) =>
      `${measure}は${lowest}度から${highest}度の間で入力してください。`,
    more: "その他の運動：挙上位での回旋、内転、肩甲骨",
  },
);

/** The questionnaire. */
export const SPADI = say(
  {
    short:
      "The items are named here in short, in the order of the questionnaire that the patient has filled in.",
    pain: "How bad is the pain? 0 none, 10 the worst imaginable",
    disability: "How hard is it? 0 not at all, 10 so hard that help is needed",
    soFar: (total: string, pain: string, disability: string) =>
      `SPADI ${total} of 100: pain ${pain}, disability ${disability}`,
    allAnswered: "All 13 answered.",
    unanswered: (number: number) => `${number} of 13 not answered. Up to two may be left out of each half.`,
  },
  {
    short: "項目名は略して示しています。順番は、患者が記入した質問票と同じです。",
    pain: "痛みの強さ（0：なし〜10：想像できる最大の痛み）",
    disability: "動作の困難さ（0：困難なし〜10：介助が必要なほど困難）",
    soFar: (total, pain, disability) => `SPADI ${total}／100：疼痛 ${pain}、能力障害 ${disability}`,
    allAnswered: "13項目すべて回答済みです。",
    unanswered: (number) => `13項目中${number}項目が未回答です。未回答は各部分2項目まで認められます。`,
  },
);

/** A finding in words. `changed`: what has changed since the first one, in brackets, or nothing. */
export const FOUND = say(
  {
    asAtFirst: " (as at first)",
    more: (by: number) => ` (${by} more)`,
    less: (by: number) => ` (${by} less)`,
    angle: (angle: string, kind: Kind, changed: string) => `${angle}° ${kind}${changed}`,
    angles: (measure: string, angles: string[]) => `${measure}: ${angles.join(", ")}`,
    pain: (pain: Pain, value: number, changed: string) => `${PAINS[pain].toLowerCase()} ${value}${changed}`,
    pains: (pains: string[]) => `Pain of 10: ${pains.join(", ")}`,
    spadiUnanswered: "SPADI: too much was left unanswered for a score",
    spadi: (total: string, pain: string, disability: string) =>
      `SPADI ${total} of 100: pain ${pain}, disability ${disability}`,
    spadiSince: (total: string, pain: string, disability: string, changed: string, verdict: string) =>
      `SPADI ${total} of 100${changed}: pain ${pain}, disability ${disability}. ${verdict}`,
    unimportant: "No important change",
    perhapsBetter: "Perhaps an important improvement",
    perhapsWorse: "Perhaps an important worsening",
    better: "An important improvement",
    worse: "An important worsening",
  },
  {
    asAtFirst: "（初回と同じ）",
    more: (by) => `（+${by}）`,
    less: (by) => `（−${by}）`,
    angle: (angle, kind, changed) => `${KINDS[kind]} ${angle}°${changed}`,
    angles: (measure, angles) => `${measure}：${angles.join("、")}`,
    pain: (pain, value, changed) => `${PAINS[pain]} ${value}${changed}`,
    pains: (pains) => `痛み（10段階）：${pains.join("、")}`,
    spadiUnanswered: "SPADI：未回答が多く、スコアを出せません",
    spadi: (total, pain, disability) => `SPADI ${total}／100：疼痛 ${pain}、能力障害 ${disability}`,
    spadiSince: (total, pain, disability, changed, verdict) =>
      `SPADI ${total}／100${changed}：疼痛 ${pain}、能力障害 ${disability}。${verdict}`,
    unimportant: "意味のある変化なし",
    perhapsBetter: "意味のある改善の可能性",
    perhapsWorse: "意味のある悪化の可能性",
    better: "意味のある改善",
    worse: "意味のある悪化",
  },
);
