import { Skeleton } from "@mantine/core";
import { IconChartLine } from "@tabler/icons-react";
import { lazy } from "react";
import { t } from "../../lib/i18n";
import { LazyPart } from "../../ui/LazyPart";
import { OpenOnDemand } from "../../ui/OpenOnDemand";

const RhythmOfRecording = lazy(() =>
  import("./RhythmCard").then((module) => ({ default: module.RhythmOfRecording })),
);
const RhythmOfRun = lazy(() => import("./RhythmCard").then((module) => ({ default: module.RhythmOfRun })));
const Live = lazy(() => import("./LiveRhythmCard").then((module) => ({ default: module.LiveRhythmCard })));

const FALLBACK = <Skeleton h={560} />;

export function RecordingRhythm({ recordingId }: { recordingId: string }) {
  return (
    <OpenOnDemand
      title={t("recordings:recording.rhythm")}
      open={t("recordings:recording.showRhythm")}
      icon={<IconChartLine size={20} />}
      fallback={FALLBACK}
    >
      <RhythmOfRecording recordingId={recordingId} />
    </OpenOnDemand>
  );
}

export function RunRhythm({ runId }: { runId: string }) {
  return (
    <LazyPart loading={FALLBACK}>
      <RhythmOfRun runId={runId} />
    </LazyPart>
  );
}

/** The rhythm of the present take or playback, at the station. */
export function LiveRhythm({ patientId }: { patientId: string }) {
  return (
    <LazyPart loading={<Skeleton h={400} />}>
      <Live patientId={patientId} />
    </LazyPart>
  );
}
