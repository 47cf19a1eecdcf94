import { Card, Skeleton, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useStation } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { ApparatusView } from "./ApparatusView";
import { GhostPanel } from "./GhostPanel";
import { Ghost } from "./ghost";
import { limitsOf, rangeViolations } from "./limits";

/** Shows a ghost that plays a recording at the recording's own speed, with this station's ranges. */
export default function RecordingApparatus({ recordingId }: { recordingId: string }) {
  const station = useStation();
  const motion = useQuery({
    queryKey: ["recording-motion", recordingId],
    queryFn: () => api.recordingMotion(recordingId),
    staleTime: Number.POSITIVE_INFINITY,
  });
  const axes = station?.axes;
  const limits = useMemo(() => (axes ? limitsOf(axes) : []), [axes]);
  const taught = motion.data;
  const ghost = useMemo(() => (taught ? new Ghost(taught) : null), [taught]);
  const violations = useMemo(() => (taught ? rangeViolations(taught, limits) : []), [taught, limits]);
  return (
    <Card withBorder component="section" aria-label={t("digital-twin:view.motion")}>
      <Title order={2} size="h3" mb="sm">
        {t("digital-twin:view.motion")}
      </Title>
      <ProblemNote error={motion.error} />
      {motion.isPending && <Skeleton h={400} />}
      {taught && ghost && (
        <>
          <GhostPanel ghost={ghost} violations={violations} />
          <ApparatusView
            side={taught.side}
            limits={limits}
            real={null}
            ghost={ghost}
            label={t("digital-twin:view.recordingLabel")}
          />
        </>
      )}
    </Card>
  );
}
