import { Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useAlive, useLive, useStation } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { ApparatusView } from "./ApparatusView";
import { GhostPanel } from "./GhostPanel";
import { GhostSquare } from "./GhostSquare";
import { Ghost } from "./ghost";
import { LiveFrame } from "./LiveFrame";
import { limitsOf, rangeViolations } from "./limits";
import { liveAngles } from "./liveAngles";

/** The live apparatus. The loaded recording is drawn over it before the arm moves. */
export default function StationApparatus() {
  const station = useStation();
  const alive = useAlive();
  const side = useLive("side");
  const mode = useLive("mode");
  const run = useLive("run");
  const runId = run?.run_id ?? null;
  const motion = useQuery({
    queryKey: ["run-motion", runId],
    queryFn: () => api.runMotion(runId ?? ""),
    enabled: runId !== null,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const axes = station?.axes;
  const limits = useMemo(() => (axes ? limitsOf(axes) : []), [axes]);
  const recorded = motion.data;
  const ghost = useMemo(() => (recorded ? new Ghost(recorded) : null), [recorded]);
  const violations = useMemo(() => (recorded ? rangeViolations(recorded, limits) : []), [recorded, limits]);
  // From the approach on, only the real arm is shown.
  const shown = mode === "ready" && alive ? ghost : null;
  return (
    <LiveFrame note={shown && <GhostNote />}>
      {shown && <GhostPanel ghost={shown} violations={violations} playsItself />}
      {mode === "ready" && <ProblemNote error={motion.error} />}
      {station && side && (
        <div className={alive ? "" : "stale"}>
          <ApparatusView
            compact
            side={side}
            limits={limits}
            real={liveAngles}
            ghost={shown}
            label={t("digital-twin:view.liveLabel")}
          />
        </div>
      )}
    </LiveFrame>
  );
}

function GhostNote() {
  return (
    <Text fw={600}>
      <GhostSquare />
      {t("digital-twin:ghost.explanation")}
    </Text>
  );
}
