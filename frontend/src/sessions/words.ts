import { say } from "../shared/language";

export const SESSIONS = say(
  {
    title: "Sessions",
    noneMatches: "No session matches.",
    none: "There has been no session yet.",
    began: "Began",
    patient: "Patient",
    therapist: "Therapist",
    station: "Station",
    playbacks: "Playbacks",
    stopped: "Stopped",
    ended: "Ended",
    signed: "Signed",
    open: "Open",
    notYet: "Not yet",
    any: "Any",
    from: "From",
    to: "To",
    stoppedBy: "Stopped by",
    showAll: "Show all",
  },
  {
    title: "セッション",
    noneMatches: "該当するセッションはありません。",
    none: "セッションはまだ行われていません。",
    began: "開始",
    patient: "患者",
    therapist: "療法士",
    station: "ステーション",
    playbacks: "再生",
    stopped: "停止",
    ended: "終了",
    signed: "署名",
    open: "継続中",
    notYet: "未署名",
    any: "指定なし",
    from: "開始日",
    to: "終了日",
    stoppedBy: "停止の原因",
    showAll: "すべて表示",
  },
);

/** Of the fault table; a code of before, or after, is told as it stands. */
const STOPS_JA: Record<string, string> = {
  estop_pressed: "非常停止",
  estop_unknown: "非常停止の状態が不明",
  bus_lost: "モータとの通信途絶",
  drive_silent: "モータの応答なし",
  drive_garbled: "モータの応答異常",
  drive_error: "モータのハードウェア異常",
  drive_watchdog: "通信途絶によるモータの自己停止",
  torque_lost: "トルクの喪失",
  torque_remains: "トルクの残留",
  position_jump: "位置の急変",
  position_frozen: "位置の固着",
  overtorque: "トルク超過",
  overacceleration: "加速度超過",
  position_limit: "可動範囲の逸脱",
  overspeed: "速度超過",
  following_error: "追従誤差の超過",
  setpoint_step: "指令値の飛び",
  setpoint_limit: "指令値の範囲超過",
  setpoint_acceleration: "指令値の急変",
  setpoint_frozen: "指令値の停止",
  overrun: "制御処理の遅れ",
  service_silent: "サービスとの接続断",
  other_run: "再生内容の不一致",
  journal_fault: "測定値の書き込み不能",
  load_repeated: "同じ位置での2度の抵抗",
  load_on_the_way: "移動中の抵抗",
  load_while_held: "保持中の抵抗",
  operator_stop: "操作者による停止",
  browser_lost: "ブラウザとの接続断",
  unexpected_error: "制御プログラムの異常",
};

/** A stop's cause in words: estop_pressed is "Emergency stop pressed". */
export const stopWords = say<(code: string) => string>(
  (code) => {
    const words = code.replace(/^estop/, "emergency_stop").replaceAll("_", " ");
    return words.charAt(0).toUpperCase() + words.slice(1);
  },
  (code) => STOPS_JA[code] ?? code.replaceAll("_", " "),
);
