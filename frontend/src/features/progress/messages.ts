import type { Chart } from "../../lib/api/client";
import { say } from "../../lib/language";

export const PROGRESS = say(
  {
    title: "Progress",
    weeks: "Weeks are counted from the first assessment or session.",
    figure: (title: string, shows: string) => `${title}. ${shows} Its numbers can be shown below.`,
    showNumbers: "Show the numbers",
    hideNumbers: "Hide the numbers",
    numbers: (title: string) => `Numbers: ${title}`,
  },
  {
    title: "経過",
    weeks: "週数は、最初の評価またはセッションから数えます。",
    figure: (title, shows) => `${title}。${shows}数値は下に表示できます。`,
    showNumbers: "数値を表示",
    hideNumbers: "数値を閉じる",
    numbers: (title) => `数値：${title}`,
  },
);

/** What each chart is called, what it shows, and what is said where there is nothing yet. */
export const CHARTS = say<Record<Chart, { title: string; shows: string; nothing: string }>>(
  {
    rom: {
      title: "Range of motion",
      shows:
        "The affected shoulder over the weeks, with its first measurement, the other shoulder and the reference.",
      nothing: "No range of motion has been measured yet.",
    },
    pain: {
      title: "Pain",
      shows: "0 to 10, as it was told in assessments and around sessions.",
      nothing: "Nobody has been asked for pain yet.",
    },
    spadi: {
      title: "SPADI",
      shows:
        "Less is better. In the shaded band an improvement is perhaps important to the patient, below it surely.",
      nothing: "No SPADI has been filled in yet.",
    },
    tracking: {
      title: "How well recordings were reproduced",
      shows: "Playback against what was asked for, of the motor that did worst, by recording and method.",
      nothing: "Nothing has been played and compared yet.",
    },
    correction: {
      title: "Learned correction",
      shows:
        "How much the learned method had come to correct by the end of each session, in the motor it corrects most.",
      nothing: "Nothing has been played by the learned method yet.",
    },
    adherence: {
      title: "Sessions a week",
      shows: "Sessions in which something was played, and how many there were to be by the programme.",
      nothing: "There has been no session yet.",
    },
  },
  {
    rom: {
      title: "関節可動域",
      shows: "患側の週ごとの推移です。初回の測定値、反対側の肩、参考値も示します。",
      nothing: "関節可動域はまだ測定されていません。",
    },
    pain: {
      title: "痛み",
      shows: "評価時とセッション前後に聞き取った痛み（0〜10）です。",
      nothing: "痛みはまだ聞き取られていません。",
    },
    spadi: {
      title: "SPADI",
      shows:
        "低いほど良好です。網掛けの範囲は患者にとって意味のある改善の可能性、その下は意味のある改善を示します。",
      nothing: "SPADIはまだ記入されていません。",
    },
    tracking: {
      title: "記録動作の再現精度",
      shows:
        "指令値に対する再生の誤差です。誤差が最も大きいモータについて、記録動作と再生方法ごとに示します。",
      nothing: "再生と比較はまだ行われていません。",
    },
    correction: {
      title: "学習による補正",
      shows: "各セッション終了時の学習方式の補正量です。補正が最も大きいモータについて示します。",
      nothing: "学習方式での再生はまだ行われていません。",
    },
    adherence: {
      title: "週ごとのセッション数",
      shows: "再生を行ったセッションの回数と、プログラムで指定された週の回数です。",
      nothing: "セッションはまだ行われていません。",
    },
  },
);
