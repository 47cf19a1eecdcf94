import { Badge, Button, Card, Group, SimpleGrid, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { api, type Run, type Session } from "../api/client";
import { EditableNote } from "../shared/EditableNote";
import { formatClock, formatDeg, formatMoment } from "../shared/format";
import { LOAD_LEVELS } from "../shared/levels";
import { ButtonLink, PageLink } from "../shared/links";
import { Plot } from "../shared/Plot";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";

const OUTCOMES: Record<Run["outcome"], string> = {
  loaded: "Going on",
  completed: "Played to its end",
  returned: "Ended early",
  stopped: "Stopped",
  unloaded: "Not played",
  interrupted: "Interrupted: the control program ended",
};

/** One visit: what was played, and how closely the playback followed the teaching. */
export function SessionPage() {
  const { sessionId } = useParams({ from: "/sessions/$sessionId" });
  const queries = useQueryClient();
  const session = useQuery({ queryKey: ["session", sessionId], queryFn: () => api.session(sessionId) });
  const keep = (saved: Session) => queries.setQueryData(["session", sessionId], saved);
  const end = useMutation({ mutationFn: () => api.endSession(sessionId), onSuccess: keep });
  const note = useMutation({
    mutationFn: (text: string) => api.updateSession(sessionId, { note: text }),
    onSuccess: keep,
  });
  useTitle(session.data ? `Session of ${session.data.patient.name}` : "Session");
  if (session.error) return <ProblemNote error={session.error} />;
  if (!session.data) return <Skeleton h={300} />;
  const it = session.data;
  return (
    <Stack>
      <Group justify="space-between" align="start">
        <div>
          <Title order={2}>
            Session of{" "}
            <PageLink inherit to="/patients/$patientId" params={{ patientId: it.patient.id }}>
              {it.patient.name}
            </PageLink>
          </Title>
          <Text>
            {formatMoment(it.started_at)}
            {it.ended_at ? ` to ${formatMoment(it.ended_at)}` : ", still open"}
          </Text>
        </div>
        {!it.ended_at && (
          <Group>
            <ButtonLink to="/" search={{ patient: it.patient.id }} variant="default">
              To the station
            </ButtonLink>
            <Button loading={end.isPending} onClick={() => end.mutate()}>
              End session
            </Button>
          </Group>
        )}
      </Group>
      <ProblemNote error={end.error} />
      <EditableNote label="Note" value={it.note} save={(text) => note.mutateAsync(text)} />
      {it.runs.length === 0 && <Text>Nothing has been played in this session yet.</Text>}
      {it.runs.map((run, place) => (
        <RunCard key={run.id} run={run} number={place + 1} />
      ))}
    </Stack>
  );
}

function RunCard({ run, number }: { run: Run; number: number }) {
  const figures = useQuery({
    queryKey: ["run-figures", run.id],
    queryFn: () => api.runFigures(run.id),
    enabled: run.comparison !== null,
    staleTime: Number.POSITIVE_INFINITY,
  });
  return (
    <Card withBorder padding="lg" component="section" aria-label={`Playback ${number}`}>
      <Stack>
        <Group justify="space-between">
          <Title order={3}>
            {number}.{" "}
            <PageLink inherit to="/recordings/$recordingId" params={{ recordingId: run.recording_id }}>
              {run.recording_name}
            </PageLink>
          </Title>
          <Group>
            <Text>{formatClock(new Date(run.started_at))}</Text>
            <Badge
              size="lg"
              variant="light"
              color={run.outcome === "completed" ? "indigo" : "grape"}
              tt="none"
            >
              {OUTCOMES[run.outcome]}
            </Badge>
          </Group>
        </Group>
        {run.load_level !== null && (
          <Text c="dimmed">
            Resistance level {run.load_level} of {LOAD_LEVELS}
          </Text>
        )}
        {run.stop && <Text fw={600}>{run.stop.message}</Text>}
        {run.comparison ? (
          <>
            <Errors run={run} comparison={run.comparison} />
            <ProblemNote error={figures.error} />
            {figures.isPending && <Skeleton h={340} />}
            <SimpleGrid cols={{ base: 1, lg: 2 }}>
              {figures.data?.motors.map(({ motor, figure }) => (
                <div key={motor}>
                  <Title order={4}>Motor {motor}</Title>
                  <Plot
                    figure={figure}
                    label={`Motor ${motor}: teaching and playback angle on the left axis, error on the right axis`}
                  />
                </div>
              ))}
            </SimpleGrid>
          </>
        ) : (
          <Text>Nothing was played, so there is nothing to compare.</Text>
        )}
      </Stack>
    </Card>
  );
}

function Errors({ run, comparison }: { run: Run; comparison: NonNullable<Run["comparison"]> }) {
  return (
    <Table maw={640} withTableBorder verticalSpacing="xs" data-testid="errors">
      <Table.Caption>
        Playback minus teaching, {comparison.samples} samples{run.rate_hz ? ` at ${run.rate_hz} Hz` : ""}
      </Table.Caption>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>Motor</Table.Th>
          <Table.Th ta="right">Peak, deg</Table.Th>
          <Table.Th ta="right">at, s</Table.Th>
          <Table.Th ta="right">RMSE, deg</Table.Th>
          <Table.Th ta="right">Start, deg</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {comparison.motors.map((motor) => (
          <Table.Tr key={motor.motor}>
            <Table.Td>{motor.motor}</Table.Td>
            <Table.Td ta="right">{formatDeg(motor.peak_deg, 2)}</Table.Td>
            <Table.Td ta="right">{motor.peak_at_s.toFixed(1)}</Table.Td>
            <Table.Td ta="right">{formatDeg(motor.rmse_deg, 2)}</Table.Td>
            <Table.Td ta="right">{formatDeg(motor.start_deg, 2)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
