import type { Schemas } from "../../lib/api/client";
import { say } from "../../lib/language";
import { count, lower } from "./messages";

/** How the sessions of a week compare with what was wished for. */
type Week = { sessions: number; wished: number | null; planned: number; done: number };
const week = ({ sessions, wished, planned, done }: Week) => {
  const held = wished === null ? `${sessions} sessions` : `${sessions} of ${wished} sessions`;
  return planned ? `${held}, ${done} of ${planned} planned repetitions` : held;
};
const weekJa = ({ sessions, wished, planned, done }: Week) => {
  const held = wished === null ? `${sessions}回` : `${wished}回中${sessions}回`;
  return planned ? `${held}（予定した反復${planned}回中${done}回）` : held;
};
export const REGULARITY = say(
  {
    now: (now: Week) => `This week: ${week(now)}.`,
    nowAndBefore: (now: Week, before: Week) => `This week: ${week(now)}. The week before: ${week(before)}.`,
  },
  {
    now: (now) => `今週のセッション：${weekJa(now)}。`,
    nowAndBefore: (now, before) => `今週のセッション：${weekJa(now)}。先週：${weekJa(before)}。`,
  },
);

/** What a session's programme asked for, and what was done of it. `of` follows the programme's name. */
export const PLAN = say(
  {
    title: "Planned and done",
    of: (version: number, done: number, planned: number) =>
      `, version ${version}: ${done} of ${planned} planned repetitions`,
    timer: (played: string, minutes: number) => `${played} of ${count(minutes, "minute")} played`,
    timeIsUp: (played: string, minutes: number) =>
      `${played} of ${count(minutes, "minute")} played: the time is up, no further recording is to be begun`,
    number: "No.",
    recording: "Recording",
    planned: "Planned",
    repetitions: "Repetitions done",
    otherwise: "What was otherwise",
    repeated: (done: number, planned: number) => `${done} of ${planned}`,
    besides: (runs: { recording: string; played: string }[]) =>
      `Played besides: ${runs.map((run) => `${run.recording} (${lower(run.played)})`).join("; ")}.`,
    lessRange: (percent: number) => `less range while it played, down to ${percent} %`,
    leftOut: "Left out",
    notYet: "Not yet",
  },
  {
    title: "予定と実施",
    of: (version, done, planned) => `（第${version}版）：予定した反復${planned}回中${done}回を実施`,
    timer: (played, minutes) => `再生時間 ${played}（タイマー${minutes}分）`,
    timeIsUp: (played, minutes) =>
      `再生時間 ${played}（タイマー${minutes}分）：時間になりました。次の記録動作は始めないでください`,
    number: "番号",
    recording: "記録動作",
    planned: "予定",
    repetitions: "実施した反復",
    otherwise: "予定との違い",
    repeated: (done, planned) => `${planned}回中${done}回`,
    besides: (runs) =>
      `プログラム外の再生：${runs.map((run) => `${run.recording}（${run.played}）`).join("；")}。`,
    lessRange: (percent) => `再生中に可動範囲を縮小（最小${percent}%）`,
    leftOut: "実施なし",
    notYet: "未実施",
  },
);

/** How a run ended, where there is something to say of it. */
export const OUTCOMES = say<Partial<Record<Schemas["PlannedRun"]["outcome"], string>>>(
  {
    loaded: "goes on",
    returned: "ended early",
    stopped: "stopped",
    unloaded: "loaded, not played",
    interrupted: "interrupted",
  },
  {
    loaded: "継続中",
    returned: "途中で終了",
    stopped: "停止",
    unloaded: "再生せず",
    interrupted: "中断",
  },
);
