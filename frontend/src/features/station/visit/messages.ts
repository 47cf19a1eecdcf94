import type { Check } from "../../../lib/api/client";
import { say } from "../../../lib/language";
import type { Step } from "./steps";

export const STEP_WORDS = say<Record<Step, string>>(
  {
    begin: "Patient and programme",
    checklist: "Checklist",
    pain_before: "Pain before",
    play: "Play",
    pain_after: "Pain after",
    note: "Note and signature",
  },
  {
    begin: "患者とプログラム",
    checklist: "開始前の確認",
    pain_before: "開始前の痛み",
    play: "再生",
    pain_after: "終了後の痛み",
    note: "所見と署名",
  },
);

/** How to do what only the apparatus can tell. */
export const HOW = say<Partial<Record<Check["check"], string>>>(
  {
    pedal: "Plug it in, and step on it once.",
    estop: "Press the switch, release it, and acknowledge the stop.",
  },
  {
    pedal: "接続して、一度踏んでください。",
    estop: "スイッチを押して解除し、画面の「確認」ボタンを押してください。",
  },
);

/** A session, step by step. */
export const VISIT = say(
  {
    title: "Session",
    steps: "Steps of the session",
    done: "done",
    lastSigned: "The last session is signed. ",
    look: "Look at it",
    programme: "Programme",
    version: (name: string, number: number) => `${name} (version ${number})`,
    none: "None: recordings are chosen one by one",
    item: (position: number, name: string, settings: string) => `${position}. ${name}: ${settings}`,
    asTaught: "as it was taught, once",
    goOn: "Go on",
    begin: "Begin the session",
    isSo: "Confirm",
    isSoThat: (check: string) => `Confirm: ${check}`,
    allSo: (count: number) => `Confirm all ${count} checks`,
    notSeen: "Not seen yet. ",
    open: "Open",
    givenBy: (who: string, at: string) => `${who}, ${at}`,
    seen: (at: string) => `Seen by the apparatus, ${at}`,
    checkedFor: (recording: string) => `For ${recording}.`,
    nothingTaught: "Nothing has been taught yet; the fixtures are asked for later.",
    toPain: "Go to pain before",
    toPainLater: "Skip to pain score",
    worstPain: "Worst pain during the session",
    painBefore: "Pain before",
    painAfter: "Pain after",
    notAsked: "Skip: not asked",
    painIs: (label: string, pain: number) => `${label}: ${pain}`,
    enough: "Finish playing: go to pain after",
    signLater: "Sign it later: begin another session",
    painScale: "0: none. 10: the worst imaginable.",
  },
  {
    title: "セッション",
    steps: "セッションの手順",
    done: "済み",
    lastSigned: "前回のセッションは署名済みです。",
    look: "見る",
    programme: "プログラム",
    version: (name, number) => `${name}（第${number}版）`,
    none: "なし（記録動作を個別に選ぶ）",
    item: (position, name, settings) => `${position}. ${name}：${settings}`,
    asTaught: "教示どおり、1回",
    goOn: "次へ",
    begin: "セッションを開始",
    isSo: "確認した",
    isSoThat: (check) => `確認した：${check}`,
    allSo: (count) => `${count}項目すべてを目視で確認しました`,
    notSeen: "まだ検出していません。",
    open: "未確認",
    givenBy: (who, at) => `${who}、${at}`,
    seen: (at) => `装置が検出、${at}`,
    checkedFor: (recording) => `対象：${recording}`,
    nothingTaught: "まだ何も教示されていません。固定具は後で確認します。",
    toPain: "開始前の痛みへ",
    toPainLater: "後で確認：開始前の痛みへ",
    worstPain: "セッション中の最も強い痛み",
    painBefore: "開始前の痛み",
    painAfter: "終了後の痛み",
    notAsked: "未聴取のまま次へ",
    painIs: (label, pain) => `${label}：${pain}`,
    enough: "再生を終えて終了後の痛みへ",
    signLater: "署名は後にして、次のセッションを開始",
    painScale: "0：なし、10：想像できる最大の痛み。",
  },
);
