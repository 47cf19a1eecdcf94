import { Group, Progress, Stack, Text } from "@mantine/core";
import {
  IconArrowBackUp,
  IconArrowsDiagonalMinimize2,
  IconPlayerPause,
  IconPlayerPlay,
  IconTargetArrow,
} from "@tabler/icons-react";
import { api, type Live, type Schemas } from "../../lib/api/client";
import { formatDuration, formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";
import { CommandButton } from "./CommandButton";
import { EndRangeCounter } from "./EndRangeCounter";
import { describePath, ReversalNotice } from "./ReversalNotice";
import { RESISTANCE_LEVELS } from "./resistanceLevels";
import { SelfPacedStatus } from "./SelfPaced";
import { StretchStatus } from "./StretchStatus";

type RunState = { mode: Live["mode"]; run: Schemas["RunLive"] };

/** The loaded recording and the arm's position on it. */
export function LoadedRun({ run }: { run: Schemas["RunLive"] }) {
  const alive = useAlive();
  const mode = useLive("mode");
  return (
    <Stack className={alive ? "" : "stale"}>
      <Text size="lg" fw={600}>
        {run.recording_name ?? t("station:play.unnamed")}
        <Text span size="md" fw={400}>
          {t("station:play.level", { level: run.resistance_level, most: RESISTANCE_LEVELS })}
        </Text>
      </Text>
      {run.changes.length > 0 && (
        <Text data-testid="changes">
          {t("station:play.settings", {
            changes: formatList(
              run.changes.map((change, place) => translateServerText(change, run.changes_keys[place])),
            ),
          })}
        </Text>
      )}
      {mode === "ready" && <MoveToStart />}
      {mode === "approaching" && run.left_s !== null && (
        <Text fz={28} fw={700} role="status">
          {t("station:play.approaching", { left: formatDuration(run.left_s) })}
        </Text>
      )}
      {mode === "returning" && run.left_s !== null && (
        <Text fz={28} fw={700} role="status">
          {t("station:play.returning", { left: formatDuration(run.left_s) })}
        </Text>
      )}
      {(mode === "playing" || mode === "paused") && <RunningPlayback mode={mode} run={run} />}
    </Stack>
  );
}

/** Shows the check before the arm moves, and the button that moves the arm to the start. */
function MoveToStart() {
  return (
    <>
      <Text>{t("station:play.safetyCheck")}</Text>
      <Group align="start">
        <CommandButton
          held
          command="approach"
          send={() => api.approach(store.seen())}
          leftSection={<IconTargetArrow size={26} />}
        >
          {t("station:play.approach")}
        </CommandButton>
        <CommandButton command="unload" send={api.unload} variant="default">
          {t("station:play.cancel")}
        </CommandButton>
      </Group>
    </>
  );
}

/**
 * Shows the state, the remaining time and the progress, with the controls. What comes and goes is below the
 * controls, so that they do not move under a finger.
 */
function RunningPlayback({ mode, run }: RunState) {
  const share = run.duration_s > 0 ? (100 * run.position_s) / run.duration_s : 0;
  return (
    <>
      <Group justify="space-between">
        <Text fz={28} fw={700} role="status">
          {describePath(mode, run)}
        </Text>
        {run.left_s !== null && (
          <Text fz={28} data-testid="left">
            {t("station:play.remaining", { left: formatDuration(run.left_s) })}
          </Text>
        )}
      </Group>
      <PlaybackControls mode={mode} run={run} />
      {/* The arm of a stretch is at the end of its path while it is held. */}
      {!run.stretch && (
        <Progress size={20} value={share} aria-label={t("station:play.progress")} transitionDuration={100} />
      )}
      {run.range_percent < 99.5 && (
        <Text size="lg" data-testid="range">
          {t("station:play.reducedRange", { percent: Math.round(run.range_percent) })}
        </Text>
      )}
      {run.self_pacing && <SelfPacedStatus pacing={run.self_pacing} />}
      {run.stretch && <StretchStatus stretch={run.stretch} />}
      <EndRangeCounter run={run} />
      <ReversalNotice mode={mode} run={run} />
    </>
  );
}

function PlaybackControls({ mode, run }: RunState) {
  return (
    <Group align="start">
      {mode === "paused" && (
        <CommandButton
          held
          command="play"
          send={() => api.play(store.seen())}
          leftSection={<IconPlayerPlay size={26} />}
        >
          {run.at_start && !run.reversing ? t("station:play.play") : t("station:play.playOn")}
        </CommandButton>
      )}
      {mode === "playing" && (
        <CommandButton command="pause" send={api.pause} leftSection={<IconPlayerPause size={26} />}>
          {t("station:play.pause")}
        </CommandButton>
      )}
      <CommandButton
        command="reduce_range"
        send={api.reduceRange}
        variant="default"
        leftSection={<IconArrowsDiagonalMinimize2 size={26} />}
      >
        {t(run.stretch ? "station:stretch.reduce" : "station:play.reduceRange")}
      </CommandButton>
      <CommandButton
        held
        command="return"
        send={() => api.returnArm(store.seen())}
        variant="default"
        leftSection={<IconArrowBackUp size={26} />}
      >
        {t("station:play.returnAndRelease")}
      </CommandButton>
    </Group>
  );
}
