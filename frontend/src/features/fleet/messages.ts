import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { formatDuration, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { describeMode } from "../../safety/modes";

export type Shown = Schemas["StationStatus"];
export type State = Schemas["StationReport"];
export const silentSince = (heardAt: string | null) =>
  heardAt === null
    ? t("fleet:stations.never")
    : t("fleet:stations.lastHeard", { moment: formatMoment(heardAt) });

/** Return what the station is doing, in the words of its own page. */
export function describeActivity(state: State): string {
  if (state.device !== "running") return t("fleet:stations.restarting");
  const stop = state.causes.length > 0 ? { arm_held: state.arm_held, causes: [] } : null;
  const run = state.progress ? ({ reversing: state.progress.reversing } as Schemas["RunLive"]) : null;
  return describeMode({ mode: state.mode, torque: state.torque, stop, run });
}

/** Return the progress of a playback or a take, or an empty text. */
export function describeProgress(state: State): string {
  const left = state.progress?.left_s ?? null;
  if (left !== null) return t("fleet:stations.left", { span: formatDuration(left) });
  return state.take_s === null ? "" : t("fleet:stations.take", { span: formatDuration(state.take_s) });
}

export const operatedBy = (name: string) => t("fleet:stations.operatedBy", { name });
export const describeVersion = ({ number, since, software }: Schemas["StationVersion"]) =>
  t("fleet:stations.version", { number, since: formatMoment(since), software });
