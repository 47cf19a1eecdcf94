import { Skeleton, Text } from "@mantine/core";
import { IconCube } from "@tabler/icons-react";
import { lazy, useEffect, useState } from "react";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { whenIdle } from "../../lib/whenIdle";
import { LazyPart } from "../../ui/LazyPart";
import { OpenOnDemand } from "../../ui/OpenOnDemand";
import { LiveFrame } from "./LiveFrame";

// The 3-D view is half of the page's size, so it loads on demand.
const StationApparatus = lazy(() => import("./StationApparatus"));
const RecordingApparatus = lazy(() => import("./RecordingApparatus"));

const RunApparatus = lazy(() => import("./RunApparatus"));

const HEIGHT = 560;

/**
 * The view on the station page. It loads while there is no torque, because loading and preparing can block the
 * page and Stop. Once loaded, it stays.
 */
export function LiveApparatus() {
  const torque = useLive("torque");
  const [open, setOpen] = useState(false);
  const free = torque === "off";
  useEffect(() => {
    // The view loads after the page's own work, so that the controls appear first.
    return free ? whenIdle(() => setOpen(true)) : undefined;
  }, [free]);
  const waits = (
    <LiveFrame>{torque !== null && !free && <Text>{t("digital-twin:view.torqueOn")}</Text>}</LiveFrame>
  );
  if (!open) return waits;
  return (
    <LazyPart loading={waits}>
      <StationApparatus />
    </LazyPart>
  );
}

export function RecordingGhost({ recordingId }: { recordingId: string }) {
  return (
    <OpenOnDemand
      title={t("digital-twin:view.motion")}
      open={t("digital-twin:view.open")}
      icon={<IconCube size={20} />}
      fallback={<Skeleton h={HEIGHT} role="status" aria-label={t("digital-twin:view.drawing")} />}
    >
      <RecordingApparatus recordingId={recordingId} />
    </OpenOnDemand>
  );
}

/** Shows the played motion of a run on the run's own clock. */
export function RunPlayback({ runId }: { runId: string }) {
  return (
    <LazyPart loading={<Skeleton h={HEIGHT} role="status" aria-label={t("digital-twin:view.drawing")} />}>
      <RunApparatus runId={runId} />
    </LazyPart>
  );
}
