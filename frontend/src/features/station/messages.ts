import type { Schemas } from "../../lib/api/client";
import { say } from "../../lib/language";
import type { FirstStep } from "./firstSteps";

type Side = Schemas["Live"]["side"];

const SHOULDERS: Record<Side, string> = { left: "左肩", right: "右肩" };

export const STATION = say(
  {
    title: "Station",
    notHere: (station: string) =>
      `You do not work at ${station}: you watch, and may stop it. An administrator can assign you to it.`,
    shoulder: (side: Side): string => (side === "left" ? "Left shoulder" : "Right shoulder"),
    contraindications: (side: Side): string => `Contraindications, ${side} shoulder`,
    shoulderNotes: (shoulder: string, notes: string) => `${shoulder} · ${notes}`,
    goesOn: "What goes on",
    lately: "Lately",
    waits: "Sent. It waits for the apparatus to confirm it.",
    hold: "Hold it down for a second: the arm will move.",
    again: "The arm will move. Press once more to confirm.",
  },
  {
    title: "ステーション",
    notHere: (station) =>
      `${station}の担当ではありません。見守ることと、停止することはできます。担当への割り当ては管理者ができます。`,
    shoulder: (side) => (side === "left" ? "左肩" : "右肩"),
    contraindications: (side) => `禁忌（${side === "left" ? "左" : "右"}肩）`,
    shoulderNotes: (shoulder, notes) => `${shoulder}・${notes}`,
    goesOn: "進行中の再生",
    lately: "最近の出来事",
    waits: "送信しました。装置の応答を待っています。",
    hold: "1秒間押し続けてください。腕が動きます。",
    again: "腕が動きます。もう一度押すと確定します。",
  },
);

/** While the database is away. */
export const AWAY = say(
  {
    ofToday:
      "The database is away. A session can begin, or goes on, for the patients who were here today; it is written there when it is back.",
    nobody:
      "The database is away, and nobody is kept ready here: those are the patients of today whose care goes on by a programme.",
    contraindications: (what: string) => `Contraindications: ${what}`,
  },
  {
    ofToday:
      "データベースが応答していません。今日このステーションで扱った患者のセッションは、開始も続行もできます。データベースが戻ると書き込まれます。",
    nobody:
      "データベースが応答しておらず、準備済みの患者がいません。今日扱った患者のうち、治療中でプログラムのある方が対象です。",
    contraindications: (what) => `禁忌：${what}`,
  },
);

/** Whoever has just come to the simulated apparatus. */
export const FIRST = say(
  {
    title: "First steps",
    at: (step: number, of: number) => `First steps, on the simulated apparatus: ${step} of ${of}`,
    hide: "Hide this",
    signUp: "Sign somebody up",
  },
  {
    title: "はじめての操作",
    at: (step, of) => `はじめての操作（模擬装置）：${of}のうち${step}`,
    hide: "表示しない",
    signUp: "登録へ進む",
  },
);

export const FIRST_WORDS = say<Record<FirstStep, string>>(
  {
    sign_up: "Sign a patient up: anybody, nothing here moves a real arm.",
    choose: "Choose the patient below. Where the sides differ, say that the apparatus has been turned.",
    teach:
      "In the panel of the simulated apparatus, try the emergency stop: press it, release it, and acknowledge the stop. Look at what the list names, and start teaching. Then have the arm guided in the panel: a hand moves it, and a foot is on the pedal meanwhile. When the hand is away again, finish teaching.",
    begin: "Begin the session, go through its checklist, and say what the pain is before.",
    play: "Load what was taught, hold “Move to the start” until the arm moves, and play. Try “Less” and “Stop” as well.",
    look: "That was the main job. Look at teaching against playback, say what the pain is now, and sign the note.",
  },
  {
    sign_up: "まず患者を登録します。実際の腕は動かないので、誰でもかまいません。",
    choose: "下で患者を選びます。左右が異なるときは、装置の向きを変えたことを知らせてください。",
    teach:
      "模擬装置のパネルで非常停止を試します。押して解除し、画面の「確認」ボタンを押してください。一覧の項目を確認し、教示を開始します。次に、パネルの「ペダルを踏んで腕を導く」を押します。手が腕を動かし、その間は足がペダルを踏んでいます。手が離れたら、教示を終了してください。",
    begin: "セッションを開始し、開始前の確認を進め、開始前の痛みを記録します。",
    play: "教示した動作を読み込み、腕が動くまで「開始位置へ移動」を押し続け、再生します。「可動範囲を狭める」と「停止」も試してください。",
    look: "これで一通りの操作は終わりです。教示と再生を見比べ、終了後の痛みを記録して、所見に署名してください。",
  },
);

export const ANGLES = say(
  {
    title: "Angles",
    setpoint: "setpoint",
    measured: "measured",
    torqueOn: "Torque on",
    torqueOff: "Torque off",
    torqueUnknown: "Torque not known",
    motor: (motor: number) => `Motor ${motor}`,
    scapula: "Scapula, through the links",
    abduction: "Shoulder abduction",
    flexion: "Shoulder flexion",
    rotation: "Rotation of the upper arm",
  },
  {
    title: "角度",
    setpoint: "指令値",
    measured: "測定値",
    torqueOn: "トルク入",
    torqueOff: "トルク切",
    torqueUnknown: "トルク不明",
    motor: (motor) => `モータ${motor}`,
    scapula: "肩甲骨（リンク機構）",
    abduction: "肩関節 外転",
    flexion: "肩関節 屈曲",
    rotation: "上腕 回旋",
  },
);

/** Who operates the apparatus. */
export const LEASE = say(
  {
    nobody: "Nobody operates the apparatus now. Whoever begins something here does.",
    you: (since: string) => `You operate the apparatus since ${since}.`,
    youFrom: (since: string, from: string) =>
      `You operate the apparatus since ${since}. You took over from ${from}.`,
    release: "Stop operating",
    other: (who: string, since: string) => `${who} operates the apparatus at another browser since ${since}.`,
    away: (since: string) => `That browser cannot be reached since ${since}.`,
    youWatch: "You watch. Stop works from here too.",
    takeOver: "Take over",
    paused: "The playback was paused because the browser that operates it could not be reached.",
    takeOverFrom: (who: string) => `Take over from ${who}`,
    takeOverNobody: "Take over from nobody",
    moving: "The arm is being moved or held. From now on you answer for it; what goes on is not interrupted.",
    standing: "From now on you operate the apparatus, and the other browser watches.",
    isTold: (who: string) => `${who} is told at once, and it is written down.`,
    watchOn: "Go on watching",
  },
  {
    nobody: "現在、装置を操作している人はいません。ここで何かを始めると操作者になります。",
    you: (since) => `${since}から、あなたが装置を操作しています。`,
    youFrom: (since, from) => `${since}から、${from}さんを引き継いで装置を操作しています。`,
    release: "操作権を手放す",
    other: (who, since) => `${since}から、${who}さんが別のブラウザで装置を操作しています。`,
    away: (since) => `${since}から、そのブラウザに接続できません。`,
    youWatch: "見守り中です。「停止」はここからも使えます。",
    takeOver: "引き継ぐ",
    paused: "操作していたブラウザに接続できなくなったため、再生を一時停止しました。",
    takeOverFrom: (who) => `${who}さんから引き継ぐ`,
    takeOverNobody: "操作を引き継ぐ",
    moving: "腕は動作中または保持中です。操作責任はあなたに移ります。進行中の動作は中断しません。",
    standing: "以後はあなたが装置を操作し、相手のブラウザは見守りになります。",
    isTold: (who) => `${who}さんにすぐ通知され、記録に残ります。`,
    watchOn: "見守りを続ける",
  },
);

/** How punctual the control loop is. */
export const LOOP = say(
  {
    at: (hz: number, missed: string) => `Control loop at ${hz} Hz: ${missed}`,
    noneMissed: "no cycle missed",
    missed: (count: number) => (count === 1 ? "1 cycle missed" : `${count} cycles missed`),
    within: (ms: string) => `99.9 % began within ${ms} ms`,
    realTime: "real time granted",
    noRealTime: "real time not granted",
    locked: "memory locked",
    notLocked: "memory not locked",
  },
  {
    at: (hz, missed) => `制御周期 ${hz} Hz：${missed}`,
    noneMissed: "欠落なし",
    missed: (count) => `${count}周期の欠落`,
    within: (ms) => `99.9%が${ms} ms以内に開始`,
    realTime: "リアルタイム優先あり",
    noRealTime: "リアルタイム優先なし",
    locked: "メモリ固定あり",
    notLocked: "メモリ固定なし",
  },
);

/** Choosing what is played, and playing it. */
export const PLAY = say(
  {
    title: "Play back",
    done: (item: string) => `${item} · done`,
    item: (position: number, name: string) => `${position}. ${name}`,
    lasting: (name: string, side: string, lasts: string) => `${name} · ${side} · ${lasts}`,
    choose: "Choose a recording",
    nothingYet: "Nothing to play yet: teach a motion first.",
    recording: "Recording",
    planned: "Planned",
    besides: "Besides",
    before: "Before it is loaded:",
    load: "Load",
    aRecording: "A recording",
    level: (level: number, most: number) => ` · resistance level ${level} of ${most}`,
    played: (changes: string) => `Played ${changes}`,
    check:
      "Check that the patient is seated and the fixtures are closed. The motors will take the arm slowly to where the recording starts, and hold it there.",
    approach: "Move to the start",
    notNow: "Not now",
    approaching: (left: string) => `Moving to the start, ${left} left`,
    returning: (left: string) => `Moving back, ${left} left`,
    left: (left: string) => `${left} left`,
    progress: "Progress of the playback",
    range: (percent: number) => `${percent} % of the range; it comes back repetition by repetition`,
    play: "Play",
    playOn: "Play on",
    pause: "Pause",
    less: "Reduce range",
    back: "Back and release",
    saved: "The playback is saved. ",
    compare: "Look at teaching against playback",
  },
  {
    title: "再生",
    done: (item) => `${item}・実施済み`,
    item: (position, name) => `${position}. ${name}`,
    lasting: (name, side, lasts) => `${name}・${side}・${lasts}`,
    choose: "記録を選んでください",
    nothingYet: "再生できるものがまだありません。先に動作を教示してください。",
    recording: "記録動作",
    planned: "予定",
    besides: "プログラム外",
    before: "読み込む前に：",
    load: "読み込む",
    aRecording: "記録動作",
    level: (level, most) => `・抵抗許容レベル ${level}（${most}段階中）`,
    played: (changes) => `再生設定：${changes}`,
    check:
      "患者が座り、固定具が閉じていることを確かめてください。モータが腕をゆっくりと開始位置まで動かし、そこで保持します。",
    approach: "開始位置へ移動",
    notNow: "今はしない",
    approaching: (left) => `開始位置へ移動中、残り ${left}`,
    returning: (left) => `復帰中、残り ${left}`,
    left: (left) => `残り ${left}`,
    progress: "再生の進行状況",
    range: (percent) => `範囲${percent}%。反復ごとに元に戻ります`,
    play: "再生",
    playOn: "再生を続ける",
    pause: "一時停止",
    less: "可動範囲を狭める",
    back: "戻してトルクを切る",
    saved: "再生を保存しました。",
    compare: "教示と再生を比較する",
  },
);

/** The arm was taken back because it met resistance. */
export const TAKEN_BACK = say(
  {
    playing: "Playing",
    reversing: "Taking the arm back",
    heldBack: "Taken back, holding",
    atStart: "At the start, holding",
    paused: "Paused, holding",
    times: (count: number) =>
      count === 1 ? "Taken back once in this playback" : `Taken back ${count} times in this playback`,
    look: "Look after the patient first. ",
    playOn: (button: string) =>
      `${button} tries again from here; resistance in the same place again stops the playback. `,
    back: (button: string) => `${button} takes the arm to where it came from. `,
    stop: (button: string) => `${button} lets it go here.`,
  },
  {
    playing: "再生中",
    reversing: "腕を引き戻し中",
    heldBack: "引き戻して保持中",
    atStart: "開始位置で保持中",
    paused: "一時停止・保持中",
    times: (count) => `この再生で${count}回、腕を引き戻しました`,
    look: "先に患者の様子を確かめてください。",
    playOn: (button) =>
      `「${button}」：ここからもう一度試します。同じ位置で再び抵抗を受けると、再生を停止します。`,
    back: (button) => `「${button}」：腕を元の位置まで戻します。`,
    stop: (button) => `「${button}」：ここで腕を離します。`,
  },
);

/** The simulated hand, foot and switch. */
export const SIMULATOR = say(
  {
    title: "Simulated apparatus",
    what: "In place of hand, foot and the patient's switch. With a real apparatus this panel is not here.",
    motion: "Motion that the hand follows",
    lasting: (name: string, seconds: string) => `${name} · ${seconds} s`,
    csv: "CSV",
    guide: "Guide the arm, foot on the pedal",
    stepOn: "Step on the pedal",
    lift: "Lift the foot",
    press: "Press the e-stop switch",
    release: "Release the e-stop switch",
    left: (seconds: string) => ` ${seconds} s left.`,
  },
  {
    title: "模擬装置",
    what: "手・足・患者のスイッチの代わりです。実機の装置では表示されません。",
    motion: "手がたどる動作",
    lasting: (name, seconds) => `${name}・${seconds}秒`,
    csv: "CSV",
    guide: "ペダルを踏んで腕を導く",
    stepOn: "ペダルを踏む",
    lift: "足を離す",
    press: "非常停止スイッチを押す",
    release: "非常停止スイッチを解除する",
    left: (seconds) => `残り${seconds}秒。`,
  },
);

export const HAND = say<Record<Schemas["Hand"]["phase"], string>>(
  {
    away: "The hand is away.",
    reaching: "The hand takes the arm to where the motion starts.",
    tracing: "The hand moves the arm along the motion.",
    leaving: "The hand lets go.",
  },
  {
    away: "手は離れています。",
    reaching: "手が腕を動作の開始位置へ運んでいます。",
    tracing: "手が動作に沿って腕を動かしています。",
    leaving: "手が腕を離しています。",
  },
);

export const SOURCES = say<Record<Schemas["Motion"]["source"], string>>(
  { "built-in": "Built in", recorded: "Recorded", uploaded: "Uploaded" },
  { "built-in": "内蔵", recorded: "記録", uploaded: "アップロード" },
);

/** Which shoulder the apparatus stands for. */
export const STANDS = say(
  {
    turned: (side: Side) => `Turned to the ${side} shoulder …`,
    standsFor: (side: Side) => `The apparatus stands for the ${side} shoulder`,
    treated: (side: Side) => `The patient's ${side} one is treated.`,
    turning: (side: Side) => `For the ${side} shoulder`,
    before: "Motors 3 and 4 turn the other way round on the other shoulder. Before anything moves:",
    armOut: "The patient's arm is out of the apparatus.",
    isTurned: (side: Side) =>
      `The apparatus is turned by 180 degrees, and its pin is locked for the ${side} side.`,
    armIn: "The arm that is to be treated lies in the apparatus, and hangs down.",
    confirm: (side: Side) => `It stands for the ${side} shoulder`,
    notNow: "Not now",
  },
  {
    turned: (side) => `${SHOULDERS[side]}用に向きを変えた…`,
    standsFor: (side) => `装置は${SHOULDERS[side]}用の向きです`,
    treated: (side) => `患者の治療側は${SHOULDERS[side]}です。`,
    turning: (side) => `${SHOULDERS[side]}用への変更`,
    before: "反対側の肩では、モータ3と4が逆向きに回ります。何かを動かす前に：",
    armOut: "患者の腕が装置から出ている。",
    isTurned: (side) => `装置を180°回し、ピンを${SHOULDERS[side]}用の側で固定した。`,
    armIn: "治療する腕が装置に収まり、下に垂れている。",
    confirm: (side) => `${SHOULDERS[side]}用の向きになっている`,
    notNow: "今はしない",
  },
);

/** Teaching a motion by hand. */
export const TEACH = say(
  {
    title: "Teach",
    nothing: "Nothing recorded yet",
    take: (take: number, seconds: string) => `Take ${take}: ${seconds} s`,
    finish: "Finish teaching",
    fixtures: "What the arm is in",
    first: "Arm fixer 1 (motions 1 to 5)",
    second: "Arm fixer 2 and elbow fixer 1 (motion 6)",
    name: "Name of the motion",
    unnamed: "Motion",
    start: "Start teaching",
    before: "Before teaching",
    allSo: (count: number) =>
      count === 1 ? "Confirm the check and start teaching" : `Confirm all ${count} checks and start teaching`,
    saved: (name: string, lasts: string) => `Saved: ${name}, ${lasts}`,
    liftFirst: "Lift your foot off the pedal first",
    noPedal: "The pedal does not answer",
    recording: "Recording",
    press: "Press the pedal to record",
    seconds: (seconds: string) => `${seconds} s`,
  },
  {
    title: "教示",
    nothing: "まだ収録していません",
    take: (take, seconds) => `収録${take}：${seconds}秒`,
    finish: "教示を終了",
    fixtures: "使う固定具",
    first: "腕固定具1（運動1〜5）",
    second: "腕固定具2と肘固定具1（運動6）",
    name: "動作の名前",
    unnamed: "動作",
    start: "教示を開始",
    before: "教示の前の確認",
    allSo: (count) =>
      count === 1 ? "目視で確認しました：教示を開始" : `${count}項目すべてを目視で確認しました：教示を開始`,
    saved: (name, lasts) => `保存済み：${name}、${lasts}`,
    liftFirst: "先にペダルから足を離してください",
    noPedal: "ペダルが応答しません",
    recording: "収録中",
    press: "ペダルを踏むと収録します",
    seconds: (seconds) => `${seconds}秒`,
  },
);
