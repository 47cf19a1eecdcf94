import type { Schemas } from "../api/client";
import { formatMoment, formatSpan } from "../shared/format";
import { modeWords } from "../shared/modes";

export type Shown = Schemas["StationShown"];
export type State = Schemas["StationTold"];

export const STATIONS = {
  title: "Stations",
  here: "This station",
  simulated: "Simulated",
  connecting: "Connecting to the service …",
  lost: "Connection lost: what the stations do is not known here.",
  silent: "Silent: what it does is not known.",
  never: "Not heard since this service began.",
  doubled: "Two services bear this name. Give one of them another in its configuration.",
  restarting: "Its control program does not answer.",
  nobody: "Nobody on the apparatus, as far as you may see.",
  configuration: "Configuration and calibration",
} as const;

export const silentSince = (heardAt: string | null) =>
  heardAt === null ? STATIONS.never : `Last heard ${formatMoment(heardAt)}.`;

/** What it does, as on its own page. */
export function doingWords(state: State): string {
  if (state.device !== "running") return STATIONS.restarting;
  const stop = state.causes.length > 0 ? { arm_held: state.arm_held, causes: [] } : null;
  const run = state.progress ? ({ reversing: state.progress.reversing } as Schemas["RunLive"]) : null;
  return modeWords({ mode: state.mode, stop, run });
}

/** How far a playback or a take is; nothing where neither goes on. */
export function progressWords(state: State): string {
  if (state.progress) return `${formatSpan(state.progress.left_s)} left`;
  return state.take_s === null ? "" : `Take of ${formatSpan(state.take_s)}`;
}

export const operatedBy = (name: string) => `Operated by ${name}`;
export const versionWords = (one: Schemas["StationVersion"]) =>
  `Version ${one.number}, since ${formatMoment(one.since)}, Kata ${one.software}`;
