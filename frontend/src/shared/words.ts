import type { Live, Recording, Session } from "../api/client";
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
    closed: "非常停止 準備完了",
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
  { motor: "モータ", from: "下限（°）", to: "上限（°）", fastest: "最高速度（°/s）" },
);

/** How much resistance the arm may meet. */
export const LEVEL = say(
  {
    label: "Resistance level",
    of: (level: number, most: number) => `${level} of ${most}`,
    asLast: ", as last time",
    lower: "One level lower",
    higher: "One level higher",
    means: (most: number) =>
      `How hard the arm may resist before it is taken back. 1: the lightest touch, which the arm's own weight may be. ${most}: the motors' rated torque.`,
  },
  {
    label: "負荷レベル",
    of: (level, most) => `${most}段階中 ${level}`,
    asLast: "（前回と同じ）",
    lower: "1段階下げる",
    higher: "1段階上げる",
    means: (most) =>
      `腕がどれだけ抵抗したら引き戻すかを決めます。1はごく軽い力で、腕の重さだけで達することがあります。${most}はモータの定格トルクです。`,
  },
);

/** How the next playback is played. */
export const PLAYING = say(
  {
    speed: "Speed",
    range: "Range",
    repetitions: "Repetitions",
    pause: "Pause at each end",
    percent: "%",
    seconds: "s",
    less: (label: string) => `${label}: less`,
    more: (label: string) => `${label}: more`,
    way: "Way of playing",
    smooth: "Smooth",
    smoothIs: "As it was taught, without its tremor.",
    learned: "Learned",
    learnedIs: "Smooth, and closer with every playback of this recording with the same settings.",
    paper: "As in the paper",
    paperIs: "Ten steps a second, for comparison. It jumps at the start.",
    asTaught: "As it was taught, once",
    told: (settings: string) =>
      `${settings}. Less range is less at both ends, around the middle of the motion.`,
    toldAsLast: (settings: string) =>
      `${settings}, as last time. Less range is less at both ends, around the middle of the motion.`,
    ofTheRange: (percent: number) => `${percent} % of the range`,
    ofTheSpeed: (percent: number) => `${percent} % of the speed`,
    times: (count: number) => `${count} repetitions`,
    pauses: (seconds: number) => `${seconds} s of pause at each end`,
    byLearning: "learned from earlier playbacks",
    asInThePaper: "as in the paper, at 10 Hz",
  },
  {
    speed: "速度",
    range: "可動範囲",
    repetitions: "反復回数",
    pause: "両端での休止",
    percent: "%",
    seconds: "秒",
    less: (label) => `${label}を減らす`,
    more: (label) => `${label}を増やす`,
    way: "再生方法",
    smooth: "平滑",
    smoothIs: "教示した動作から手の震えを除いて再生します。",
    learned: "学習",
    learnedIs: "平滑に再生し、同じ設定で再生するたびに教示へ近づきます。",
    paper: "論文方式",
    paperIs: "比較用に、毎秒10段階で動かします。開始時に急に動きます。",
    asTaught: "教示どおり、1回",
    told: (settings) => `${settings}。可動範囲を減らすと、動作の中央を基準に両端が小さくなります。`,
    toldAsLast: (settings) =>
      `${settings}（前回と同じ）。可動範囲を減らすと、動作の中央を基準に両端が小さくなります。`,
    ofTheRange: (percent) => `範囲${percent}%`,
    ofTheSpeed: (percent) => `速度${percent}%`,
    times: (count) => `反復${count}回`,
    pauses: (seconds) => `両端で休止${seconds}秒`,
    byLearning: "これまでの再生から学習",
    asInThePaper: "論文方式（10 Hz）",
  },
);

export const FIGURE = say({ drawing: "The figure is being drawn" }, { drawing: "グラフを描いています" });

/** What Plotly calls its buttons. */
export const PLOTLY = say<Record<string, string>>(
  {},
  {
    "Download plot as a PNG": "PNG画像として保存",
    "Download plot": "画像として保存",
    Zoom: "拡大範囲の選択",
    Pan: "移動",
    "Zoom in": "拡大",
    "Zoom out": "縮小",
    Autoscale: "全体を表示",
    "Reset axes": "軸を元に戻す",
    "Click to enter": "クリックして入力",
    "Double-click to zoom back out": "ダブルクリックで全体表示",
    "Taking snapshot - this may take a few seconds": "画像を作成しています",
    "Snapshot succeeded": "画像を保存しました",
    "Sorry, there was a problem downloading your snapshot!": "画像を保存できませんでした",
  },
);

const MONTHS = Array.from({ length: 12 }, (_, month) => `${month + 1}月`);

/** How Plotly writes a day. */
export const PLOTLY_DAYS = say<Record<string, string | string[]>>(
  {},
  { months: MONTHS, shortMonths: MONTHS, date: "%Y/%m/%d" },
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
    stations: "一覧",
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
    confirmed: (time) => `装置が確認 ${time}`,
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

/** How a session ended. */
export const END_REASONS = say<Record<NonNullable<Session["end_reason"]>, string>>(
  {
    completed: "Completed as planned",
    shortened: "Shortened by the therapist",
    stopped: "Ended by a stop",
    patient_request: "At the patient's request",
    other: "Other",
  },
  {
    completed: "予定どおり終了",
    shortened: "療法士が短縮",
    stopped: "停止のため終了",
    patient_request: "患者の希望により終了",
    other: "その他",
  },
);

/** The note of a session. */
export const NOTE = say(
  {
    title: "Note",
    nothing: "Nothing is written yet.",
    label: "Note of this session",
    drafted: "Drafted from what was measured. Read it, and change what is not so.",
    saved: "Saved",
    notSaved: "Not saved yet",
    anew: "Draft it anew",
    signAs: (who: string) => `Sign as ${who}`,
    onceSigned: "Once signed, the note stays as it is.",
    howEnded: "How did it end?",
    end: "End the session",
    signedBy: (who: string, when: string) => `Signed by ${who}, ${when}`,
    addendumBy: (who: string, when: string) => `Addendum by ${who}, ${when}`,
    addendum: "Addendum",
    addendumIs: "The signed note stays as it is; what is to be added stands below it.",
    addAs: (who: string) => `Add as ${who}`,
  },
  {
    title: "所見",
    nothing: "まだ記入されていません。",
    label: "このセッションの所見",
    drafted: "測定結果から作成した下書きです。内容を確かめ、違うところを直してください。",
    saved: "保存済み",
    notSaved: "未保存",
    anew: "下書きを作り直す",
    signAs: (who) => `${who}として署名`,
    onceSigned: "署名すると、所見は変更できなくなります。",
    howEnded: "終了理由",
    end: "セッションを終了",
    signedBy: (who, when) => `署名：${who}（${when}）`,
    addendumBy: (who, when) => `追記：${who}（${when}）`,
    addendum: "追記",
    addendumIs: "署名済みの所見は変更されません。追記は所見の下に表示されます。",
    addAs: (who) => `${who}として追記`,
  },
);

/** The name of the thing, which every language leaves as it is. */
export const BRAND = { latin: "Kata", kanji: "肩型" };
