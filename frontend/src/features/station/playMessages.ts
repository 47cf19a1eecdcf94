import { say } from "../../lib/language";

/** How much resistance the arm may meet. */
export const LEVEL = say(
  {
    label: "Resistance level",
    of: (level: number, most: number) => `${level} of ${most}`,
    asLast: ", as last time",
    choose: "Choose a level",
    lower: "One level lower",
    higher: "One level higher",
    atMost: (highest: number) => `The doctor’s limits allow ${highest} at most.`,
    means: (most: number) =>
      `How hard the arm may resist before it is taken back. 1: the lightest touch, which the arm's own weight may be. ${most}: the motors' rated torque.`,
  },
  {
    label: "抵抗許容レベル",
    of: (level, most) => `${most}段階中 ${level}`,
    asLast: "（前回と同じ）",
    choose: "レベルを選んでください",
    lower: "1段階下げる",
    higher: "1段階上げる",
    atMost: (highest) => `医師の制限により、上限は${highest}です。`,
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
    outOfRange: (min: number, max: number, unit: string) => `Enter ${min} to ${max}${unit && ` ${unit}`}.`,
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
    outOfRange: (min, max, unit) => `${min}～${max}${unit && ` ${unit}`} の値を入力してください。`,
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
    told: (settings) => `${settings}。可動範囲を狭めると、動作の中央を基準に両端が小さくなります。`,
    toldAsLast: (settings) =>
      `${settings}（前回と同じ）。可動範囲を狭めると、動作の中央を基準に両端が小さくなります。`,
    ofTheRange: (percent) => `範囲${percent}%`,
    ofTheSpeed: (percent) => `速度${percent}%`,
    times: (count) => `反復${count}回`,
    pauses: (seconds) => `両端で休止${seconds}秒`,
    byLearning: "これまでの再生から学習",
    asInThePaper: "論文方式（10 Hz）",
  },
);
