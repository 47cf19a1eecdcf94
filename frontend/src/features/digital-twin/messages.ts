import { say } from "../../lib/language";
import type { End, Motor } from "./limits";
import type { ViewName } from "./view";

/** What each motor moves, as a therapist sees it. */
export const MOVES = say<Record<Motor, string>>(
  {
    1: "Scapula, through the links",
    2: "Scapula, through the links",
    3: "Lifts the arm sideways",
    4: "Swings the arm forward",
    5: "Turns the upper arm",
  },
  {
    1: "肩甲骨（リンク機構）",
    2: "肩甲骨（リンク機構）",
    3: "腕の側方挙上",
    4: "腕の前方挙上",
    5: "上腕の回旋",
  },
);

/** The body's angles, in the order of a pose. */
export const BODY = say<readonly [string, string, string, string, string]>(
  [
    "Scapular abduction",
    "Scapular upward rotation",
    "Shoulder abduction",
    "Shoulder flexion",
    "External rotation",
  ],
  ["肩甲骨 外転", "肩甲骨 上方回旋", "肩関節 外転", "肩関節 屈曲", "肩関節 外旋"],
);

export const VIEW_WORDS = say<Record<ViewName, string>>(
  { corner: "Corner", front: "Front", side: "Side", back: "Back", above: "Above" },
  { corner: "斜め", front: "前", side: "横", back: "後ろ", above: "上" },
);

export const AT_END = say<Record<End, (motor: Motor) => string>>(
  {
    lower: (motor) => `Motor ${motor} is at the lower end of its range.`,
    upper: (motor) => `Motor ${motor} is at the upper end of its range.`,
  },
  {
    lower: (motor) => `モータ${motor}は可動範囲の下限にあります。`,
    upper: (motor) => `モータ${motor}は可動範囲の上限にあります。`,
  },
);

/** Looking at the apparatus in three dimensions. */
export const VIEW = say(
  {
    title: "Arm and apparatus",
    motion: "The motion",
    open: "Show in three dimensions",
    notNow: "To be opened while the motors have no torque.",
    drawing: "The apparatus is being drawn",
    view: "View",
    left: "Turn left",
    right: "Turn right",
    nearer: "Nearer",
    further: "Further away",
    motors: "What each motor moves",
    noAngles: "Where the arm is, is not known: it is not drawn.",
    noPose: "No position of the scapula fits the angles of motors 1 and 2: the arm is not drawn.",
    no3d: "This browser cannot draw in three dimensions. The angles stand beside it in words.",
    elbow: "Body size and elbow are drawn, not measured.",
    now: "Patient, arm and apparatus, drawn from the five motors' angles. The same stands below in words.",
    taught:
      "A ghost of the arm and the apparatus, as the recording moves them. The same stands below in words.",
  },
  {
    title: "腕と装置",
    motion: "動作",
    open: "立体表示",
    notNow: "モータのトルクが切れているときに開けます。",
    drawing: "装置を描いています",
    view: "視点",
    left: "左へ回す",
    right: "右へ回す",
    nearer: "近づける",
    further: "遠ざける",
    motors: "各モータの動き",
    noAngles: "腕の位置が分からないため、描いていません。",
    noPose: "モータ1と2の角度に合う肩甲骨の位置がないため、腕を描いていません。",
    no3d: "このブラウザでは立体表示ができません。角度は文字で示します。",
    elbow: "体の大きさと肘は作図で、測定値ではありません。",
    now: "5つのモータの角度から描いた患者・腕・装置。同じ内容を下に文字で示します。",
    taught: "記録動作どおりに動く腕と装置のゴースト表示。同じ内容を下に文字で示します。",
  },
);

/** A recording, played by a ghost before it may touch anybody. */
export const GHOST = say(
  {
    title: "Ghost",
    shows: "The ghost shows what has been loaded; nothing moves yet.",
    play: "Play the ghost",
    pause: "Pause the ghost",
    time: "Time on the recording",
    seconds: (seconds: string) => `${seconds} s`,
    at: (at: string, length: string) => `${at} of ${length} s`,
    leaves: (motor: Motor, at: string, angle: string) =>
      `Motor ${motor} would leave its range at ${at} s, with ${angle}°.`,
  },
  {
    title: "ゴースト表示",
    shows: "ゴースト表示は読み込んだ動作を示します。まだ何も動きません。",
    play: "ゴースト表示を再生",
    pause: "ゴースト表示を一時停止",
    time: "記録動作の時刻",
    seconds: (seconds) => `${seconds}秒`,
    at: (at, length) => `${at}／${length}秒`,
    leaves: (motor, at, angle) => `モータ${motor}が${at}秒の時点で${angle}°となり、可動範囲を外れます。`,
  },
);
