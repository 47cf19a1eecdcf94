import type { ProgrammeItem, Schemas } from "../../lib/api/client";
import { sideWord } from "../../lib/format";
import { say } from "../../lib/language";
import { LOAD_LEVELS } from "../station/loadLevels";

/** What of a recording is set for its playing. */
export type Setting = Schemas["PlannedRun"]["changed"][number];
type Side = "left" | "right";

/** "1 session", "2 sessions". */
export const count = (number: number, one: string) => `${number} ${number === 1 ? one : `${one}s`}`;
/** To go on in a sentence with. */
export const lower = (text: string) => text.charAt(0).toLowerCase() + text.slice(1);

export const METHODS = say<Record<ProgrammeItem["method"], string>>(
  { smooth: "smooth", learned: "learned", paper: "as in the paper" },
  { smooth: "平滑", learned: "学習", paper: "論文方式" },
);

/** In the order in which they are told. */
export const SETTINGS = say<Record<Setting, string>>(
  {
    range_percent: "range",
    speed_percent: "speed",
    repetitions: "repetitions",
    pause_s: "pause",
    load_level: "resistance level",
    method: "way of playing",
  },
  {
    range_percent: "可動範囲",
    speed_percent: "速度",
    repetitions: "反復回数",
    pause_s: "休止",
    load_level: "抵抗許容レベル",
    method: "再生方法",
  },
);

/** How recordings are played, in words. */
export const PLAYED = say(
  {
    asTaught: "As it was taught, once",
    atLevel: (settings: string, level: number) => `${settings}; resistance level ${level} of ${LOAD_LEVELS}`,
    whole: (recordings: number, duration: string) =>
      `${count(recordings, "recording")}, ${duration} of playing`,
    withTimer: (words: string, minutes: number) => `${words}, timer ${count(minutes, "minute")}`,
    withWish: (words: string, sessions: number) => `${words}, ${count(sessions, "session")} a week`,
    beyond: (duration: string, minutes: number) =>
      `This takes ${duration}, and after ${count(minutes, "minute")} of playing no further recording is begun: the last ones may be left out.`,
    unknown: "not known",
    percent: (value: number) => `${value} %`,
    seconds: (value: number) => `${value} s`,
    instead: (setting: Setting, after: string, before: string) =>
      `${SETTINGS[setting]} ${after} instead of ${before}`,
    several: (words: string[]) => words.join(", "),
  },
  {
    asTaught: "教示どおりに1回",
    atLevel: (settings, level) => `${settings}、抵抗許容レベル${level}（${LOAD_LEVELS}段階）`,
    whole: (recordings, duration) => `記録動作${recordings}件、再生時間 ${duration}`,
    withTimer: (words, minutes) => `${words}、タイマー${minutes}分`,
    withWish: (words, sessions) => `${words}、週${sessions}回`,
    beyond: (duration, minutes) =>
      `再生に${duration}かかりますが、再生時間が${minutes}分を超えると次の記録動作は始まりません。最後の記録動作が行われないことがあります。`,
    unknown: "不明",
    percent: (value) => `${value}%`,
    seconds: (value) => `${value}秒`,
    instead: (setting, after, before) => `${SETTINGS[setting]} ${before}→${after}`,
    several: (words) => words.join("、"),
  },
);

/** From one version to the next. */
export const CHANGED = say(
  {
    again: (recording: string, time: number) => `${recording} (${time})`,
    leftOut: (recording: string) => `${recording} is left out`,
    added: (recording: string, played: string) => `${recording} is new: ${lower(played)}`,
    set: (recording: string, differences: string) => `${recording}: ${differences}`,
    order: "The order is another one",
    timer: {
      gone: (before: number) => `The timer of ${count(before, "minute")} is gone`,
      begun: (after: number) => `The timer is ${count(after, "minute")}`,
      moved: (after: number, before: number) => `The timer is ${count(after, "minute")} instead of ${before}`,
    },
    wish: {
      gone: (before: number) => `The wish of ${count(before, "session")} a week is gone`,
      begun: (after: number) => `The wish is ${count(after, "session")} a week`,
      moved: (after: number, before: number) =>
        `The wish is ${count(after, "session")} a week instead of ${before}`,
    },
    nothing: "Nothing of what is played",
  },
  {
    again: (recording, time) => `${recording}（${time}回目）`,
    leftOut: (recording) => `${recording}を削除`,
    added: (recording, played) => `${recording}を追加：${played}`,
    set: (recording, differences) => `${recording}：${differences}`,
    order: "順番を変更",
    timer: {
      gone: (before) => `タイマー（${before}分）を解除`,
      begun: (after) => `タイマーを${after}分に設定`,
      moved: (after, before) => `タイマー ${before}分→${after}分`,
    },
    wish: {
      gone: (before) => `希望回数（週${before}回）を解除`,
      begun: (after) => `希望回数を週${after}回に設定`,
      moved: (after, before) => `希望回数 週${before}回→週${after}回`,
    },
    nothing: "再生内容に変更なし",
  },
);

/** A programme's recordings in a table. */
export const ITEMS = say(
  {
    none: "No recording yet: add the first one.",
    inOrder: "Recordings in their order",
    isNow: (recording: string, place: number, of: number) => `${recording} is now ${place} of ${of}.`,
    number: "No.",
    recording: "Recording",
    played: "How it is played",
    time: "Time",
    change: "Change",
    up: (recording: string) => `${recording}: up`,
    down: (recording: string) => `${recording}: down`,
    settings: "Settings",
    settingsOf: (recording: string) => `${recording}: settings`,
    takeOut: (recording: string) => `${recording}: take out`,
    archived: "Archived: it cannot be played until it is restored.",
  },
  {
    none: "記録動作がまだありません。最初の記録動作を追加してください。",
    inOrder: "再生順の記録動作",
    isNow: (recording, place, of) => `${recording}は${of}件中${place}番目になりました。`,
    number: "番号",
    recording: "記録動作",
    played: "再生設定",
    time: "時間",
    change: "変更",
    up: (recording) => `${recording}：上へ`,
    down: (recording) => `${recording}：下へ`,
    settings: "設定",
    settingsOf: (recording) => `${recording}：設定`,
    takeOut: (recording) => `${recording}：外す`,
    archived: "アーカイブ済みのため、元に戻すまで再生できません。",
  },
);

/** Writing a programme. */
export const EDITOR = say(
  {
    title: "What it says",
    whole: (duration: string) => `${duration} of playing in all`,
    working: "Working out how long it takes",
    levelOpen: (recordings: string[]) => `Resistance level not chosen yet: ${recordings.join(", ")}`,
    why: "Why",
    prescribedBy: "Prescribed by",
    discard: "Discard",
    done: "Done",
    nothingToAdd: "There is nothing to prescribe yet: teach a motion of this shoulder first.",
    add: "Add a recording",
    choose: "Choose one",
    choice: (recording: string, duration: string) => `${recording} · ${duration}`,
    timer: { label: "Timer", none: "Timer: none", withIt: "With timer", unit: "minutes" },
    wish: {
      label: "Sessions a week",
      none: "Sessions a week: none",
      withIt: "With sessions a week",
      unit: "",
    },
  },
  {
    title: "プログラムの内容",
    whole: (duration) => `再生時間の合計 ${duration}`,
    working: "所要時間を計算しています",
    levelOpen: (recordings) => `抵抗許容レベルが未選択です：${recordings.join("、")}`,
    why: "理由",
    prescribedBy: "処方者",
    discard: "破棄",
    done: "完了",
    nothingToAdd: "処方できる記録動作がまだありません。先にこの肩の動作を教示してください。",
    add: "記録動作を追加",
    choose: "選んでください",
    choice: (recording, duration) => `${recording}・${duration}`,
    timer: { label: "タイマー", none: "タイマー：なし", withIt: "タイマーを使う", unit: "分" },
    wish: {
      label: "週の回数",
      none: "週の回数：指定なし",
      withIt: "週の回数を指定する",
      unit: "回",
    },
  },
);

/** A new programme. */
export const NEW = say(
  {
    title: "New programme",
    for: (patient: string) => `New programme for ${patient}`,
    thePatient: "the patient",
    noEpisode: "No episode of care is open. Open one on the patient’s page first.",
    which: "Which episode of care is it for?",
    whichMeans: "Only recordings of that shoulder can be prescribed in it.",
    episode: (side: Side, diagnosis: string) => `${sideWord(side)} shoulder: ${diagnosis}`,
    noDiagnosis: "no diagnosis noted",
    save: "Save the programme",
    name: "Name of the programme",
  },
  {
    title: "新しいプログラム",
    for: (patient) => `${patient}さんの新しいプログラム`,
    thePatient: "患者",
    noEpisode: "継続中の治療エピソードがありません。先に患者のページで開始してください。",
    which: "どの治療エピソードのプログラムですか",
    whichMeans: "その肩の記録動作だけを処方できます。",
    episode: (side, diagnosis) => `${sideWord(side)}肩：${diagnosis}`,
    noDiagnosis: "診断名の記録なし",
    save: "プログラムを保存",
    name: "プログラム名",
  },
);

/** One programme, and a patient's programmes in a list. */
export const PROGRAMME = say(
  {
    title: "Programme",
    programmes: "Programmes",
    none: "Nothing has been prescribed yet.",
    nameColumn: "Name",
    says: "What it says",
    saysNow: "What it says now",
    since: "Since",
    shoulder: (side: Side) => `${sideWord(side)} shoulder`,
    item: (recording: string, played: string) => `${recording}: ${played}`,
    itemArchived: (recording: string, played: string) =>
      `${recording}: ${played} (the recording is archived)`,
    archived: "Archived",
    change: "Change",
    rename: "Rename",
    renaming: "Rename the programme",
    restore: "Restore",
    archive: "Archive",
    closed: "Its episode of care is closed, so it is not changed any more.",
    name: "Name of the programme",
    save: "Save",
  },
  {
    title: "プログラム",
    programmes: "プログラム",
    none: "処方はまだありません。",
    nameColumn: "名前",
    says: "内容",
    saysNow: "現在の内容",
    since: "開始",
    shoulder: (side) => `${sideWord(side)}肩`,
    item: (recording, played) => `${recording}：${played}`,
    itemArchived: (recording, played) => `${recording}：${played}（アーカイブ済みの記録動作）`,
    archived: "アーカイブ済み",
    change: "変更",
    rename: "名前を変更",
    renaming: "プログラム名の変更",
    restore: "元に戻す",
    archive: "アーカイブする",
    closed: "治療エピソードが終了したため、変更できません。",
    name: "プログラム名",
    save: "保存",
  },
);

/** What a programme said from when to when. */
export const VERSIONS = say(
  {
    title: "Versions",
    one: (number: number) => `Version ${number}`,
    made: (number: number, moment: string, by: string) => `Version ${number}, ${moment}, ${by}`,
    since: (number: number, moment: string) => `Version ${number}, ${moment}`,
    show: (number: number) => `Show version ${number}`,
    hide: (number: number) => `Hide version ${number}`,
    saveAs: (number: number) => `Save as version ${number}`,
    meanwhile: (by: string, number: number) =>
      `${by} has made version ${number} in the meantime; it stands below. Yours is still here and not saved.`,
    read: (number: number) => `I have read version ${number}: mine comes after it`,
  },
  {
    title: "版の履歴",
    one: (number) => `第${number}版`,
    made: (number, moment, by) => `第${number}版　${moment}　${by}`,
    since: (number, moment) => `第${number}版　${moment}`,
    show: (number) => `第${number}版を表示`,
    hide: (number) => `第${number}版を閉じる`,
    saveAs: (number) => `第${number}版として保存`,
    meanwhile: (by, number) =>
      `編集中に${by}さんが第${number}版を作成しました（下に表示）。入力中の内容は残っていますが、まだ保存されていません。`,
    read: (number) => `第${number}版を確認し、その次の版とする`,
  },
);
