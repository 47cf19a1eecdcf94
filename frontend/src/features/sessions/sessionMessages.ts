import type { Run, Schemas } from "../../lib/api/client";
import { say } from "../../lib/language";

type Side = "left" | "right";

/** One visit. */
export const SESSION = say(
  {
    title: "Session",
    of: (patient: string) => `Session of ${patient}`,
    fromTo: (from: string, to: string) => `${from} to ${to}`,
    stillOpen: (from: string) => `${from}, still open`,
    toStation: "To the station",
    nothingPlayed: "Nothing has been played in this session yet.",
    playback: (number: number) => `Playback ${number}`,
    numbered: (number: number, recording: string) => `${number}. ${recording}`,
    level: (level: number, most: number) => `Resistance level ${level} of ${most}`,
    nothingToCompare: "Nothing was played, so there is nothing to compare.",
    repetitions: (done: number, planned: number) => `${done} of ${planned} repetitions`,
    takenBack: (count: number) => (count === 1 ? "taken back once" : `taken back ${count} times`),
    leastRange: (percent: number) => `down to ${percent} % of its range`,
  },
  {
    title: "セッション",
    of: (patient) => `${patient}さんのセッション`,
    fromTo: (from, to) => `${from} 〜 ${to}`,
    stillOpen: (from) => `${from} 〜（継続中）`,
    toStation: "ステーションへ",
    nothingPlayed: "このセッションでは、まだ何も再生していません。",
    playback: (number) => `再生${number}`,
    numbered: (number, recording) => `${number}. ${recording}`,
    level: (level, most) => `抵抗許容レベル ${level}（${most}段階中）`,
    nothingToCompare: "再生されていないため、比較はありません。",
    repetitions: (done, planned) => `${planned}回中${done}回反復`,
    takenBack: (count) => `抵抗による引き戻し${count}回`,
    leastRange: (percent) => `最小範囲${percent}%`,
  },
);

export const OUTCOMES = say<Record<Run["outcome"], string>>(
  {
    loaded: "Going on",
    completed: "Played to its end",
    returned: "Ended early",
    stopped: "Stopped",
    unloaded: "Not played",
    interrupted: "Interrupted: the control program ended",
  },
  {
    loaded: "継続中",
    completed: "最後まで再生",
    returned: "途中で終了",
    stopped: "停止",
    unloaded: "再生せず",
    interrupted: "中断（制御プログラムの終了）",
  },
);

/** How closely a playback followed the teaching. */
export const COMPARED = say(
  {
    caption: (samples: number) =>
      `Playback minus teaching, ${samples} samples. A positive lag is late. Smoothness is the spectral arc length: about −1.4 for one smooth movement, lower with every stop and with tremor.`,
    captionAt: (samples: number, hz: number) =>
      `Playback minus teaching, ${samples} samples at ${hz} Hz. A positive lag is late. Smoothness is the spectral arc length: about −1.4 for one smooth movement, lower with every stop and with tremor.`,
    motionsCaption: "The same by the body's motions, in its own angles",
    motor: "Motor",
    motion: "Motion",
    motorNumber: (motor: number) => `Motor ${motor}`,
    motionNamed: (number: number, name: string) => `${number} ${name}`,
    figure: (motor: number) =>
      `Motor ${motor}: teaching and playback angle on the left axis, error on the right axis`,
    heads: ["Peak, deg", "at, s", "RMSE, deg", "Start, deg", "Lag, ms", "Taught, deg", "Reached, deg"],
    motorHeads: ["Torque peak, Nm", "Smoothness taught", "played"],
    motionHeads: ["Apparatus, deg", "Healthy shoulder, deg"],
    part: "Part that the figures show",
    shown: (from: string, to: string) => `Shown: ${from} to ${to} s`,
    from: "From",
    to: "To",
    seconds: (seconds: string) => `${seconds} s`,
    all: "All of it",
  },
  {
    caption: (samples) =>
      `再生−教示、測定点${samples}個。遅れは正の値が遅れを示します。滑らかさはスペクトル弧長で、滑らかな1回の動作で約−1.4、停止や震えがあるほど低くなります。`,
    captionAt: (samples, hz) =>
      `再生−教示、測定点${samples}個（${hz} Hz）。遅れは正の値が遅れを示します。滑らかさはスペクトル弧長で、滑らかな1回の動作で約−1.4、停止や震えがあるほど低くなります。`,
    motionsCaption: "身体の運動別の比較（身体の角度）",
    motor: "モータ",
    motion: "運動",
    motorNumber: (motor) => `モータ${motor}`,
    motionNamed: (number, name) => `${number} ${name}`,
    figure: (motor) => `モータ${motor}：左軸は教示と再生の角度、右軸は誤差`,
    heads: ["最大（°）", "時刻（秒）", "RMSE（°）", "開始時（°）", "遅れ（ms）", "教示（°）", "到達（°）"],
    motorHeads: ["最大トルク（Nm）", "滑らかさ（教示）", "滑らかさ（再生）"],
    motionHeads: ["装置（°）", "健常肩（°）"],
    part: "グラフの表示範囲",
    shown: (from, to) => `表示：${from}〜${to}秒`,
    from: "開始",
    to: "終了",
    seconds: (seconds) => `${seconds}秒`,
    all: "全体",
  },
);

/** Two sessions of one patient. */
export const BESIDE = say(
  {
    title: "Beside another session",
    which: "Which session",
    none: "Any of this patient's",
    older: "Older sessions",
    caption:
      "Of a recording that was played several times, its last playback; of its motors, the one that did worst.",
    what: "What",
    here: (at: string) => `${at} (this one)`,
    change: "Change",
    pain: "Pain, 0 to 10",
    before: "Before",
    during: "During",
    after: "After",
    repetitions: "Repetitions done",
    range: "Range, %",
    level: "Resistance level",
    takenBack: "Taken back by resistance",
    rmse: "RMSE, deg",
    peak: "Largest error, deg",
    reached: (motion: string) => `Reached in ${motion}, deg`,
  },
  {
    title: "別のセッションと並べる",
    which: "セッション",
    none: "この患者のセッションから選択",
    older: "さらに前のセッション",
    caption: "同じ記録動作を何度か再生した場合は最後の再生、誤差が最大のモータ。",
    what: "項目",
    here: (at) => `${at}（このセッション）`,
    change: "変化",
    pain: "痛み（0〜10）",
    before: "開始前",
    during: "実施中",
    after: "終了後",
    repetitions: "実施した反復",
    range: "範囲（%）",
    level: "抵抗許容レベル",
    takenBack: "抵抗による引き戻し",
    rmse: "RMSE（°）",
    peak: "最大誤差（°）",
    reached: (motion) => `${motion}の到達範囲（°）`,
  },
);

/** A session in short. */
export const FACTS = say(
  {
    title: "In short",
    shoulder: (side: Side): string => (side === "left" ? "Left shoulder" : "Right shoulder"),
    unknownShoulder: "– shoulder",
    treatedBy: (therapist: string) => `treated by ${therapist}`,
    at: (station: string) => `at ${station}`,
    oneByOne: "Recordings were chosen one by one.",
    checklist: "Checklist",
    notGone: "Nobody has gone through it.",
    answer: (check: string, who: string, at: string) => `${check}: ${who}, ${at}`,
    about: (check: string, subject: string) => `${check} (${subject})`,
    seen: "seen by the apparatus",
    pain: (given: string) => `Pain (0 to 10): ${given}`,
    noPain: "Nobody has asked for pain.",
    before: (pain: number) => `${pain} before`,
    during: (pain: number) => `${pain} during`,
    after: (pain: number) => `${pain} after`,
  },
  {
    title: "概要",
    shoulder: (side) => (side === "left" ? "左肩" : "右肩"),
    unknownShoulder: "肩の側は不明",
    treatedBy: (therapist) => `担当：${therapist}`,
    at: (station) => `ステーション：${station}`,
    oneByOne: "記録動作を個別に選びました。",
    checklist: "開始前の確認",
    notGone: "確認の記録はありません。",
    answer: (check, who, at) => `${check}：${who}、${at}`,
    about: (check, subject) => `${check}（${subject}）`,
    seen: "装置が検出",
    pain: (given) => `痛み（0〜10）：${given}`,
    noPain: "痛みの記録はありません。",
    before: (pain) => `開始前 ${pain}`,
    during: (pain) => `実施中 ${pain}`,
    after: (pain) => `終了後 ${pain}`,
  },
);

export const CHECKS = say<Record<Schemas["CheckAnswer"]["check"], string>>(
  {
    side: "Side, pin in",
    fixtures: "Fixtures closed",
    belt: "Belt",
    pedal: "Pedal answers",
    estop: "Emergency stop tried",
  },
  {
    side: "左右の向き・ピン",
    fixtures: "固定具を閉じた",
    belt: "ベルト",
    pedal: "ペダルの反応",
    estop: "非常停止の動作確認",
  },
);

/** What stopped the apparatus in a session. */
export const ALARMS = say(
  {
    title: "Alarms",
    acknowledged: (at: string, what: string, ended: string) => `${at}: ${what} Acknowledged at ${ended}.`,
    notAcknowledged: (at: string, what: string) => `${at}: ${what} Not acknowledged yet.`,
  },
  {
    title: "アラーム",
    acknowledged: (at, what, ended) => `${at}：${what}${ended}に確認済み。`,
    notAcknowledged: (at, what) => `${at}：${what}未確認。`,
  },
);

/** What the answer about the apparatus' side was good for. */
export const SUBJECT_SIDES = say<Record<Side, string>>(
  { left: "left", right: "right" },
  { left: "左", right: "右" },
);
