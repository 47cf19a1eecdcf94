import {
  ActionIcon,
  Badge,
  Button,
  Group,
  Skeleton,
  Stack,
  Table,
  Text,
  TextInput,
  Title,
} from "@mantine/core";
import { IconArchive, IconCheck, IconDownload, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useState } from "react";
import { api, type Schemas } from "../api/client";
import { EditableNote } from "../shared/EditableNote";
import { formatDeg, formatMoment, formatSpan } from "../shared/format";
import { ButtonLink, PageLink } from "../shared/links";
import { Plot } from "../shared/Plot";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";

/** One recording: what it is, what each motor does in it, and its curves. */
export function RecordingPage() {
  const { recordingId } = useParams({ from: "/recordings/$recordingId" });
  const queries = useQueryClient();
  const [name, setName] = useState<string | null>(null);
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
  const figure = useQuery({
    queryKey: ["recording-figure", recordingId],
    queryFn: () => api.recordingFigure(recordingId),
    enabled: recording.data?.readable === true,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const update = useMutation({
    mutationFn: (change: Schemas["RecordingUpdate"]) => api.updateRecording(recordingId, change),
    onSuccess: (saved) => {
      setName(null);
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
        {name === null ? (
          <Group gap="xs">
            <Title order={2}>{it.name}</Title>
            <ActionIcon variant="subtle" size={44} aria-label="Rename" onClick={() => setName(it.name)}>
              <IconPencil size={20} />
            </ActionIcon>
          </Group>
        ) : (
          <form
            onSubmit={(event) => {
              event.preventDefault();
              update.mutate({ name });
            }}
          >
            <Group gap="xs">
              <TextInput
                aria-label="Name"
                w={360}
                value={name}
                onChange={(event) => setName(event.currentTarget.value)}
              />
              <ActionIcon type="submit" size={44} aria-label="Save name" loading={update.isPending}>
                <IconCheck size={20} />
              </ActionIcon>
            </Group>
          </form>
        )}
        <Group>
          {!it.archived_at && it.readable && (
            <ButtonLink
              to="/"
              search={{ patient: it.patient_id, recording: it.id }}
              leftSection={<IconPlayerPlay size={20} />}
            >
              Play at the station
            </ButtonLink>
          )}
          <Button
            component="a"
            variant="default"
            href={`/api/recordings/${it.id}/samples.csv`}
            leftSection={<IconDownload size={20} />}
            disabled={!it.readable}
          >
            CSV
          </Button>
          <Button
            variant="default"
            leftSection={<IconArchive size={20} />}
            onClick={() => update.mutate({ archived: !it.archived_at })}
          >
            {it.archived_at ? "Restore" : "Archive"}
          </Button>
        </Group>
      </Group>
      <Group gap="lg">
        <Text>Taught {formatMoment(it.taught_at)}</Text>
        <Text>{it.side === "left" ? "Left" : "Right"} shoulder</Text>
        <Text>
          {formatSpan(it.duration_s)}, {it.samples} samples at {it.rate_hz} Hz
        </Text>
        <Text>{it.station}</Text>
        {it.archived_at && <Badge color="gray">Archived</Badge>}
      </Group>
      <ProblemNote error={update.error} />
      {!it.readable && (
        <Text fw={600}>Its samples are damaged and cannot be read. Restore them from a backup.</Text>
      )}
      <EditableNote label="Note" value={it.note} save={(note) => update.mutateAsync({ note })} />
      {it.ranges.length > 0 && (
        <Table maw={640} withTableBorder verticalSpacing="xs">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Motor</Table.Th>
              <Table.Th ta="right">From, deg</Table.Th>
              <Table.Th ta="right">To, deg</Table.Th>
              <Table.Th ta="right">Fastest, deg/s</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {it.ranges.map((range) => (
              <Table.Tr key={range.motor}>
                <Table.Td>{range.motor}</Table.Td>
                <Table.Td ta="right">{formatDeg(range.min_deg)}</Table.Td>
                <Table.Td ta="right">{formatDeg(range.max_deg)}</Table.Td>
                <Table.Td ta="right">{formatDeg(range.max_speed_deg_s, 0)}</Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      )}
      <ProblemNote error={figure.error} />
      {it.readable && figure.isPending && <Skeleton h={400} />}
      {figure.data && <Plot figure={figure.data} label="Angles of the five motors over time" />}
    </Stack>
  );
}
