import { Card, Group, Progress, Select, Stack, Text, Title } from "@mantine/core";
import { IconArrowBackUp, IconPlayerPause, IconPlayerPlay, IconTargetArrow } from "@tabler/icons-react";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { api, type Schemas } from "../api/client";
import { useAlive, useLive } from "../live/hooks";
import { store } from "../live/store";
import { formatSpan } from "../shared/format";
import { LOAD_LEVELS } from "../shared/levels";
import { PageLink } from "../shared/links";
import { ProblemNote } from "../shared/problem";
import { CommandButton } from "./CommandButton";
import { LoadLevel, useLastLevel } from "./LoadLevel";
import { pathWords, TakenBack } from "./TakenBack";

/** Playback: choose, load, move to the start, play; each a step of its own. */
export function PlayPanel({ patientId, wanted }: { patientId: string; wanted: string | null }) {
  const run = useLive("run");
  // Kept here, so that it outlives the run that it was chosen for.
  const [level, setLevel] = useState<number | null>(null);
  return (
    <Card withBorder component="section" aria-label="Play back">
      <Stack>
        <Title order={3}>Play back</Title>
        {run ? (
          <Loaded run={run} />
        ) : (
          <Choose patientId={patientId} wanted={wanted} level={level} onLevel={setLevel} />
        )}
        <LastRun patientId={patientId} />
      </Stack>
    </Card>
  );
}

type Choice = {
  patientId: string;
  wanted: string | null;
  level: number | null;
  onLevel: (level: number) => void;
};

function Choose({ patientId, wanted, level, onLevel }: Choice) {
  const queries = useQueryClient();
  const recordings = useQuery({
    queryKey: ["recordings", patientId],
    queryFn: () => api.recordings(patientId),
  });
  const last = useLastLevel(patientId);
  const shownLevel = level ?? last.data ?? LOAD_LEVELS;
  const [chosen, setChosen] = useState<string | null>(wanted);
  const items = (recordings.data?.items ?? []).filter((one) => !one.archived_at);
  const value = items.some((one) => one.id === chosen) ? chosen : (items[0]?.id ?? null);
  const load = async () => {
    const session = await api.createSession(patientId);
    await api.load({ session_id: session.id, recording_id: value ?? "", load_level: shownLevel });
    void queries.invalidateQueries({ queryKey: ["session"] });
  };
  if (recordings.data && items.length === 0) return <Text>Nothing to play yet: teach a motion first.</Text>;
  return (
    <>
      <ProblemNote error={recordings.error ?? last.error} />
      <Select
        size="lg"
        label="Recording"
        allowDeselect={false}
        data={items.map((one) => ({ value: one.id, label: `${one.name} · ${formatSpan(one.duration_s)}` }))}
        value={value}
        onChange={setChosen}
      />
      <LoadLevel value={shownLevel} last={last.data ?? null} onChange={onLevel} />
      <CommandButton command="load" disabled={value === null || last.isPending} send={load}>
        Load
      </CommandButton>
    </>
  );
}

function Loaded({ run }: { run: Schemas["RunLive"] }) {
  const alive = useAlive();
  const mode = useLive("mode");
  const share = run.duration_s > 0 ? (100 * run.position_s) / run.duration_s : 0;
  return (
    <Stack className={alive ? "" : "stale"}>
      <Text size="lg" fw={600}>
        {run.recording_name ?? "A recording"}
        <Text span size="md" fw={400}>
          {" "}
          · resistance level {run.load_level} of {LOAD_LEVELS}
        </Text>
      </Text>
      {mode === "ready" && (
        <>
          <Text>
            Check that the patient is seated and the fixtures are closed. The motors will take the arm slowly
            to where the recording starts, and hold it there.
          </Text>
          <Group>
            <CommandButton command="approach" send={api.approach} leftSection={<IconTargetArrow size={26} />}>
              Move to the start
            </CommandButton>
            <CommandButton command="unload" send={api.unload} variant="default">
              Not now
            </CommandButton>
          </Group>
        </>
      )}
      {mode === "approaching" && (
        <Text fz={28} fw={700} role="status">
          Moving to the start, {formatSpan(run.left_s)} left
        </Text>
      )}
      {mode === "returning" && (
        <Text fz={28} fw={700} role="status">
          Moving back, {formatSpan(run.left_s)} left
        </Text>
      )}
      {(mode === "playing" || mode === "paused") && (
        <>
          <Group justify="space-between">
            <Text fz={28} fw={700} role="status">
              {pathWords(mode, run)}
            </Text>
            <Text fz={28} data-testid="left">
              {formatSpan(run.left_s)} left
            </Text>
          </Group>
          <Progress size={20} value={share} aria-label="Progress of the playback" transitionDuration={100} />
          <TakenBack mode={mode} run={run} />
          <Group>
            {mode === "paused" && (
              <CommandButton command="play" send={api.play} leftSection={<IconPlayerPlay size={26} />}>
                {run.at_start && !run.reversing ? "Play" : "Play on"}
              </CommandButton>
            )}
            {mode === "playing" && (
              <CommandButton command="pause" send={api.pause} leftSection={<IconPlayerPause size={26} />}>
                Pause
              </CommandButton>
            )}
            <CommandButton
              command="return"
              send={api.goBack}
              variant="default"
              leftSection={<IconArrowBackUp size={26} />}
            >
              Back and release
            </CommandButton>
          </Group>
        </>
      )}
    </Stack>
  );
}

/** Where to look at what has just been played. */
function LastRun({ patientId }: { patientId: string }) {
  const [sessionId, setSessionId] = useState<string | null>(null);
  useEffect(
    () =>
      store.onSaved((saved) => {
        if (saved.what === "run" && saved.patient_id === patientId) setSessionId(saved.session_id);
      }),
    [patientId],
  );
  if (!sessionId) return null;
  return (
    <Text>
      The playback is saved.{" "}
      <PageLink to="/sessions/$sessionId" params={{ sessionId }}>
        Look at teaching against playback
      </PageLink>
    </Text>
  );
}
