import type { Schemas } from "../../lib/api/client";
import { formatMoment, formatSpan } from "../../lib/format";
import { say } from "../../lib/language";
import { describeMode } from "../../safety/modes";

export type Shown = Schemas["StationShown"];
export type State = Schemas["StationTold"];

export const STATIONS = say(
  {
    title: "Stations",
    here: "This station",
    simulated: "Simulated",
    connecting: "Connecting to the service …",
    lost: "Connection lost: what the stations do is not known here.",
    silent: "Silent: what it does is not known.",
    never: "Not heard since this service began.",
    lastHeard: (moment: string) => `Last heard ${moment}.`,
    doubled: "Two services bear this name. Give one of them another in its configuration.",
    restarting: "Its control program does not answer.",
    nobody: "Nobody on the apparatus, as far as you may see.",
    configuration: "Configuration and calibration",
    left: (span: string) => `${span} left`,
    take: (span: string) => `Take of ${span}`,
    operatedBy: (name: string) => `Operated by ${name}`,
    version: (number: number, since: string, software: string) =>
      `Version ${number}, since ${since}, Kata ${software}`,
  },
  {
    title: "ステーション",
    here: "このステーション",
    simulated: "模擬",
    connecting: "サービスに接続しています…",
    lost: "接続が切れました。各ステーションの状態は不明です。",
    silent: "応答がなく、状態は不明です。",
    never: "このサービスの開始後、一度も応答がありません。",
    lastHeard: (moment) => `最後の応答：${moment}`,
    doubled: "同じ名前のサービスが2つあります。どちらかの設定で名前を変えてください。",
    restarting: "制御プログラムが応答しません。",
    nobody: "閲覧できる範囲では、装置に患者はいません。",
    configuration: "設定と校正",
    left: (span) => `残り ${span}`,
    take: (span) => `収録 ${span}`,
    operatedBy: (name) => `操作者：${name}`,
    version: (number, since, software) => `第${number}版（${since}から）、Kata ${software}`,
  },
);

export const silentSince = (heardAt: string | null) =>
  heardAt === null ? STATIONS.never : STATIONS.lastHeard(formatMoment(heardAt));

/** What it does, as on its own page. */
export function doingWords(state: State): string {
  if (state.device !== "running") return STATIONS.restarting;
  const stop = state.causes.length > 0 ? { arm_held: state.arm_held, causes: [] } : null;
  const run = state.progress ? ({ reversing: state.progress.reversing } as Schemas["RunLive"]) : null;
  return describeMode({ mode: state.mode, stop, run });
}

/** How far a playback or a take is; nothing where neither goes on. */
export function progressWords(state: State): string {
  if (state.progress) return STATIONS.left(formatSpan(state.progress.left_s));
  return state.take_s === null ? "" : STATIONS.take(formatSpan(state.take_s));
}

export const operatedBy = (name: string) => STATIONS.operatedBy(name);
export const versionWords = (one: Schemas["StationVersion"]) =>
  STATIONS.version(one.number, formatMoment(one.since), one.software);
