import type { Live, Recording } from "./api/client";
import { say } from "./language";

export const SIDES = say<Record<"left" | "right", string>>(
  { left: "Left", right: "Right" },
  { left: "左", right: "右" },
);

export const FIXTURES = say<Record<Recording["fixtures"][number], string>>(
  {
    arm_fixer_1: "arm fixer 1",
    arm_fixer_2: "arm fixer 2",
    elbow_fixer_1: "elbow fixer 1",
    elbow_fixer_2: "elbow fixer 2",
  },
  {
    arm_fixer_1: "腕固定具1",
    arm_fixer_2: "腕固定具2",
    elbow_fixer_1: "肘固定具1",
    elbow_fixer_2: "肘固定具2",
  },
);

/** What the apparatus does, in the therapist's words. */
export const MODES = say<Record<Live["mode"] | "holding" | "reversing", string>>(
  {
    offline: "Not connected",
    idle: "Idle, torque off",
    teaching: "Teaching, torque off",
    ready: "Recording loaded, torque off",
    approaching: "Moving to the start",
    playing: "Playing",
    paused: "Holding the arm",
    returning: "Moving back",
    stopped: "Stopped",
    holding: "Stopped, holding the arm",
    reversing: "Taking the arm back",
  },
  {
    offline: "未接続",
    idle: "待機中・トルク切",
    teaching: "教示中・トルク切",
    ready: "読み込み済み・トルク切",
    approaching: "開始位置へ移動中",
    playing: "再生中",
    paused: "腕を保持中",
    returning: "復帰中",
    stopped: "停止",
    holding: "停止・腕を保持中",
    reversing: "腕を引き戻し中",
  },
);

export const ESTOP = say(
  {
    closed: "E-stop ready",
    pressed: "E-stop pressed",
    released: "E-stop released, not acknowledged",
    missing: "E-stop does not answer",
    unknown: "E-stop unknown",
  },
  {
    closed: "非常停止 正常（作動なし）",
    pressed: "非常停止 押されています",
    released: "非常停止 解除・未確認",
    missing: "非常停止 応答なし",
    unknown: "非常停止 状態不明",
  },
);

/** Numbers, days and moments. */
export const FORMAT = say(
  {
    moment: (day: string, time: string) => `${day}, ${time}`,
    range: (from: string, to: string) => `${from} to ${to}`,
    list: (words: string[]) => words.join(", "),
  },
  {
    moment: (day, time) => `${day} ${time}`,
    range: (from, to) => `${from} 〜 ${to}`,
    list: (words) => words.join("、"),
  },
);

export const FIELDS = say(
  { showPassword: "Toggle password visibility" },
  { showPassword: "パスワードの表示を切り替え" },
);

/** A note on a record. */
export const NOTES = say({ save: "Save note", discard: "Discard" }, { save: "備考を保存", discard: "破棄" });

export const LISTS = say({ more: "Show more" }, { more: "さらに表示" });

/** Of what a recording was made, and how. */
export const MADE = say(
  {
    of: (parent: string, done: string) => `Made of ${parent}: ${done}`,
    ofAnother: (done: string) => `Made of another recording: ${done}`,
    changed: "changed",
  },
  {
    of: (parent, done) => `「${parent}」から作成：${done}`,
    ofAnother: (done) => `別の記録動作から作成：${done}`,
    changed: "変更",
  },
);

export const RANGES = say(
  { motor: "Motor", from: "From, deg", to: "To, deg", fastest: "Fastest, deg/s" },
  { motor: "モータ", from: "最小（°）", to: "最大（°）", fastest: "最高速度（°/s）" },
);

/** What stands on every page. */
export const SHELL = say(
  {
    pages: "Pages",
    station: "Station",
    stations: "Stations",
    patients: "Patients",
    sessions: "Sessions",
    administration: "Administration",
    modeUnknown: "State unknown",
    live: "Live",
    liveSimulated: "Live, simulated apparatus",
    lost: "Connection lost",
    secondsOld: (seconds: string) => `${seconds} s old`,
    minutesOld: (minutes: number) => `${minutes} min old`,
    starting: "The apparatus' control program is starting.",
    connecting: "Connecting to the service …",
  },
  {
    pages: "ページ",
    station: "ステーション",
    stations: "装置一覧",
    patients: "患者",
    sessions: "セッション",
    administration: "管理",
    modeUnknown: "状態不明",
    live: "ライブ",
    liveSimulated: "ライブ（模擬装置）",
    lost: "接続が切れました",
    secondsOld: (seconds) => `${seconds}秒前`,
    minutesOld: (minutes) => `${minutes}分前`,
    starting: "装置の制御プログラムを起動しています。",
    connecting: "サービスに接続しています…",
  },
);

/** The Stop of the screen, which is not the emergency stop. */
export const STOP = say(
  {
    stop: "Stop",
    what: "Stops under control and switches torque off. It needs the network: it is not the emergency stop. Key: Esc",
    key: "Key: Esc",
    sent: "Sent …",
    confirmed: (time: string) => `Confirmed by the device ${time}`,
    failed: (why: string) => `Not confirmed: ${why} Use the emergency stop.`,
    noAnswer: "No answer.",
  },
  {
    stop: "停止",
    what: "減速して停止し、トルクを切ります。ネットワークが必要です。非常停止ではありません。キー：Esc",
    key: "キー：Esc",
    sent: "送信しました…",
    confirmed: (time) => `装置から確認応答 ${time}`,
    failed: (why) => `確認できません：${why}非常停止を使ってください。`,
    noAnswer: "応答がありません。",
  },
);

/** A latched stop. */
export const STOPPED = say(
  {
    title: "The apparatus has been stopped",
    titleHeld: "Stopped. The motors still hold the arm",
    cleared: "This has cleared. ",
    acknowledge: "Acknowledge",
    titleMayHold: "Stopped. The motors may still hold the arm",
    titleNotKnown: "Last known: stopped. Whether the motors hold the arm is not known",
    notKnownNext: "Support the arm. What is greyed out is old.",
    hold: "Hold for a second.",
    again: "Press once more.",
    releaseTorque: "Release torque",
    releaseTorqueNext: "Support the arm first: it will sink when the motors let go.",
    acknowledgeHeld: "Acknowledge and let the arm go",
    letsGo: "Support the arm first: it will sink. Pressing Stop lets it go, too.",
    startsNothing: "It starts nothing by itself.",
    byWhom: "Whoever operates the apparatus acknowledges it, signed in and with the screen unlocked.",
  },
  {
    title: "装置は停止しました",
    titleHeld: "停止しました。モータが腕を保持しています",
    cleared: "この原因は解消しました。",
    acknowledge: "確認",
    titleMayHold: "停止しました。モータがまだ腕を保持している可能性があります",
    titleNotKnown: "最後の状態：停止。モータが腕を保持しているかどうかは不明です",
    notKnownNext: "腕を支えてください。灰色の表示は古い情報です。",
    hold: "1秒間押し続けてください。",
    again: "もう一度押してください。",
    releaseTorque: "トルクを切る",
    releaseTorqueNext: "先に腕を支えてください。モータが離すと腕が下がります。",
    acknowledgeHeld: "確認して腕を離す",
    letsGo: "先に腕を支えてください。腕が下がります。「停止」を押しても腕は離れます。",
    startsNothing: "確認しても、何も自動的には始まりません。",
    byWhom: "装置を操作する人が、サインインして画面ロックを解除した状態で確認します。",
  },
);

export const PROBLEMS = say(
  {
    fields: "Please check the marked fields.",
    page: "Something went wrong in this page. Reload it.",
  },
  {
    fields: "印の付いた項目を確認してください。",
    page: "このページで問題が起きました。再読み込みしてください。",
  },
);

/** The name of the thing, which every language leaves as it is. */
export const BRAND = { latin: "Kata", kanji: "肩型" };
