import { Card, Skeleton, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useStation } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { ApparatusView } from "./ApparatusView";
import { GhostPanel } from "./GhostPanel";
import { GhostSquare } from "./GhostSquare";
import { Companion, Ghost } from "./ghost";
import { limitsOf } from "./limits";

/** Shows a playback as it was measured, the requested motion as a ghost, and marks where the arm met resistance. */
export default function RunApparatus({ runId }: { runId: string }) {
  const played = useQuery({
    queryKey: ["played-motion", runId],
    queryFn: () => api.playedMotion(runId),
    staleTime: Number.POSITIVE_INFINITY,
  });
  return (
    <Card withBorder component="section" aria-label={t("digital-twin:run.heading")}>
      <Title order={2} size="h3" mb="sm">
        {t("digital-twin:run.heading")}
      </Title>
      <ProblemNote error={played.error} />
      {played.isPending && <Skeleton h={400} />}
      {played.data && <Played played={played.data} />}
    </Card>
  );
}

function Played({ played }: { played: Schemas["PlayedMotion"] }) {
  const axes = useStation()?.axes;
  const limits = useMemo(() => (axes ? limitsOf(axes) : []), [axes]);
  const [measured, requested] = useMemo(() => {
    const { times_s, measured_deg, setpoint_deg } = played;
    const ghost = new Ghost({ times_s, angles_deg: measured_deg });
    return [ghost, new Companion({ times_s, angles_deg: setpoint_deg }, ghost)];
  }, [played]);
  return (
    <>
      <Text>
        {t("digital-twin:run.solid")} <GhostSquare />
        {t("digital-twin:run.ghost")}
      </Text>
      {played.reversals_s.length > 0 && (
        <Text fw={600}>
          {t("digital-twin:run.resistance", { times: played.reversals_s.map((at) => formatDeg(at)) })}
        </Text>
      )}
      <GhostPanel ghost={measured} violations={[]} subject="run" marks_s={played.reversals_s} />
      <ApparatusView
        side={played.side}
        limits={limits}
        real={measured}
        ghost={requested}
        label={t("digital-twin:run.label")}
      />
    </>
  );
}
