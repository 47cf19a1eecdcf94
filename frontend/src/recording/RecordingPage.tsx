import { ActionIcon, Badge, Button, Group, Skeleton, Stack, Text, TextInput, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconAdjustments, IconArchive, IconCheck, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useNavigate, useParams } from "@tanstack/react-router";
import { useState } from "react";
import { useMay } from "../access/hooks";
import { api, type Schemas } from "../api/client";
import { RecordingGhost } from "../apparatus3d/lazily";
import { SampleLinks } from "../exchange/SampleLinks";
import { EditableNote } from "../shared/EditableNote";
import { FIXTURES } from "../shared/fixtures";
import { formatMoment, formatSpan } from "../shared/format";
import { ButtonLink, PageLink } from "../shared/links";
import { MotorRanges } from "../shared/MotorRanges";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { EditPanel } from "./EditPanel";
import { RecordingFigure } from "./RecordingFigure";

/** One recording: what it is, what each motor does in it, and its curves. */
export function RecordingPage() {
  const { recordingId } = useParams({ from: "/recordings/$recordingId" });
  const writes = useMay("write_records");
  const operates = useMay("operate");
  const queries = useQueryClient();
  const navigate = useNavigate();
  // With the version that it began with: somebody else's newer name may arrive meanwhile.
  const [renamed, setRenamed] = useState<{ name: string; seen: string } | null>(null);
  const [editing, panel] = useDisclosure(false);
  const recording = useQuery({
    queryKey: ["recording", recordingId],
    queryFn: () => api.recording(recordingId),
  });
  const patientId = recording.data?.patient_id;
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: patientId !== undefined,
  });
  const parentId = recording.data?.parent_id ?? null;
  const parent = useQuery({
    queryKey: ["recording", parentId],
    queryFn: () => api.recording(parentId ?? ""),
    enabled: parentId !== null,
  });
  const update = useMutation({
    mutationFn: (change: Schemas["RecordingUpdate"]) => api.updateRecording(recordingId, change),
    onError: () => void queries.invalidateQueries({ queryKey: ["recording", recordingId] }),
    onSuccess: (saved) => {
      setRenamed(null);
      queries.setQueryData(["recording", recordingId], saved);
      void queries.invalidateQueries({ queryKey: ["recordings"] });
    },
  });
  useTitle(recording.data?.name ?? "Recording");
  if (recording.error) return <ProblemNote error={recording.error} />;
  if (!recording.data) return <Skeleton h={300} />;
  const it = recording.data;
  return (
    <Stack>
      {patient.data && (
        <PageLink to="/patients/$patientId" params={{ patientId: patient.data.id }}>
          {patient.data.name}
        </PageLink>
      )}
      <Group justify="space-between" align="start">
        {renamed === null ? (
          <Group gap="xs">
            <Title order={1} size="h2">
              {it.name}
            </Title>
            {writes && (
              <ActionIcon
                variant="subtle"
                size={44}
                aria-label="Rename"
                onClick={() => setRenamed({ name: it.name, seen: it.updated_at })}
              >
                <IconPencil size={20} />
              </ActionIcon>
            )}
          </Group>
        ) : (
          <form
            onSubmit={(event) => {
              event.preventDefault();
              update.mutate({ name: renamed.name, updated_at: renamed.seen });
            }}
          >
            <Group gap="xs">
              <TextInput
                aria-label="Name"
                w={360}
                value={renamed.name}
                onChange={(event) => setRenamed({ ...renamed, name: event.currentTarget.value })}
              />
              <ActionIcon type="submit" size={44} aria-label="Save name" loading={update.isPending}>
                <IconCheck size={20} />
              </ActionIcon>
            </Group>
          </form>
        )}
        <Group>
          {operates && !it.archived_at && it.readable && (
            <ButtonLink
              to="/"
              search={{ patient: it.patient_id, recording: it.id }}
              leftSection={<IconPlayerPlay size={20} />}
            >
              Play at the station
            </ButtonLink>
          )}
          {writes && !it.archived_at && it.readable && (
            <Button
              variant="default"
              leftSection={<IconAdjustments size={20} />}
              aria-expanded={editing}
              onClick={panel.toggle}
            >
              Edit
            </Button>
          )}
          <SampleLinks of="recordings" id={it.id} disabled={!it.readable} />
          {writes && (
            <Button
              variant="default"
              leftSection={<IconArchive size={20} />}
              onClick={() => update.mutate({ archived: !it.archived_at, updated_at: it.updated_at })}
            >
              {it.archived_at ? "Restore" : "Archive"}
            </Button>
          )}
        </Group>
      </Group>
      <Group gap="lg">
        <Text>
          {it.parent_id ? "Made" : "Taught"} {formatMoment(it.taught_at)}
        </Text>
        <Text>{it.side === "left" ? "Left" : "Right"} shoulder</Text>
        <Text>
          {formatSpan(it.duration_s)}, {it.samples} samples
          {!it.parent_id && ` at ${it.rate_hz} Hz`}
        </Text>
        <Text>{it.station}</Text>
        {it.taught_by && <Text>Taught by {it.taught_by}</Text>}
        {it.fixtures.length > 0 && <Text>With {it.fixtures.map((one) => FIXTURES[one]).join(" and ")}</Text>}
        {it.archived_at && <Badge color="gray">Archived</Badge>}
      </Group>
      {it.parent_id && (
        <Text data-testid="made-of">
          Made of{" "}
          <PageLink to="/recordings/$recordingId" params={{ recordingId: it.parent_id }}>
            {parent.data?.name ?? "another recording"}
          </PageLink>
          . Done to what was taught: {it.done.join(", ")}.
        </Text>
      )}
      <ProblemNote error={update.error} />
      {editing && (
        <EditPanel
          key={it.id}
          recording={it}
          onKept={(made) => {
            panel.close();
            void queries.invalidateQueries({ queryKey: ["recordings"] });
            void navigate({ to: "/recordings/$recordingId", params: { recordingId: made.id } });
          }}
        />
      )}
      {!it.readable && (
        <Text fw={600}>Its samples are damaged and cannot be read. Restore them from a backup.</Text>
      )}
      <EditableNote
        label="Note"
        value={it.note}
        version={it.updated_at}
        save={(note, seen) => update.mutateAsync({ note, updated_at: seen })}
      />
      {it.ranges.length > 0 && <MotorRanges ranges={it.ranges} />}
      {it.readable && <RecordingGhost key={`ghost-${recordingId}`} recordingId={recordingId} />}
      {it.readable && <RecordingFigure key={recordingId} recordingId={recordingId} />}
    </Stack>
  );
}
