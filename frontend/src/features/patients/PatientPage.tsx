import { Badge, Button, Group, Modal, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconArchive, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, ProblemError, type Recording } from "../../lib/api/client";
import { formatDay, formatMoment, formatSpan, sideWord } from "../../lib/format";
import { useRecordings } from "../../lib/patientQueries";
import { replaceData } from "../../lib/replaceData";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ButtonLink, PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { AssessmentsSection } from "../assessments/AssessmentsSection";
import { BreakGlass, GlassBanner } from "../auth/BreakGlass";
import { useHasPermission } from "../auth/hooks";
import { RecordAccess } from "../auth/RecordAccess";
import { Episodes } from "../episodes/Episodes";
import { DataSection } from "../import-export/DataSection";
import { Programmes } from "../programmes/Programmes";
import { madeOf } from "../recordings/madeOf";
import { SessionTable } from "../sessions/SessionTable";
import { PatientForm } from "./PatientForm";
import { PATIENT, RECORDINGS } from "./patientMessages";

/** One patient: the record, the recordings and the sessions. */
export function PatientPage() {
  const { patientId } = useParams({ from: "/patients/$patientId" });
  const writes = useHasPermission("write_records");
  const operates = useHasPermission("operate");
  const queries = useQueryClient();
  const [editing, form] = useDisclosure(false);
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  const recordings = useRecordings(patientId);
  const sessions = usePagedQuery(["sessions", "of", patientId], (after) =>
    api.patientSessions(patientId, after),
  );
  const archive = useMutation({
    mutationFn: (archived: boolean) =>
      api.updatePatient(patientId, { archived, updated_at: patient.data?.updated_at ?? null }),
    onSuccess: (saved) => {
      replaceData(queries, ["patient", patientId], saved);
      void queries.invalidateQueries({ queryKey: ["patients"] });
    },
  });
  useTitle(patient.data?.name ?? PATIENT.title);
  if (patient.error instanceof ProblemError && patient.error.code === "restricted") {
    return <BreakGlass patientId={patientId} />;
  }
  if (patient.error) return <ProblemNote error={patient.error} />;
  if (!patient.data) return <Skeleton h={300} />;
  const who = patient.data;
  return (
    <RevealWhenLoaded>
      <Stack gap="xl">
        {who.restricted && <GlassBanner patientId={patientId} />}
        <Stack gap="xs">
          <Group justify="space-between" align="start">
            <div>
              <Title order={1} size="h2">
                {who.name}
              </Title>
              {who.kana && (
                <Text c="dimmed" lang="ja">
                  {who.kana}
                </Text>
              )}
            </div>
            <Group>
              {operates && !who.archived_at && (
                <ButtonLink to="/" search={{ patient: who.id }} leftSection={<IconPlayerPlay size={20} />}>
                  {PATIENT.toStation}
                </ButtonLink>
              )}
              {writes && !who.erased_at && (
                <>
                  <Button variant="default" leftSection={<IconPencil size={20} />} onClick={form.open}>
                    {PATIENT.edit}
                  </Button>
                  <Button
                    variant="default"
                    leftSection={<IconArchive size={20} />}
                    loading={archive.isPending}
                    onClick={() => archive.mutate(!who.archived_at)}
                  >
                    {who.archived_at ? PATIENT.restore : PATIENT.archive}
                  </Button>
                </>
              )}
            </Group>
          </Group>
          <Group gap="lg">
            <Text>{PATIENT.number(who.clinic_number)}</Text>
            {who.dominant_side && <Text>{PATIENT.handed(who.dominant_side)}</Text>}
            {who.birth_date && <Text>{PATIENT.born(formatDay(who.birth_date))}</Text>}
            {who.archived_at && (
              <Badge color="gray">{who.erased_at ? PATIENT.erased : PATIENT.archived}</Badge>
            )}
          </Group>
          {who.notes && <Text style={{ whiteSpace: "pre-wrap" }}>{who.notes}</Text>}
          <RecordAccess patientId={patientId} />
          <ProblemNote error={archive.error} />
        </Stack>
        <Episodes patient={who} />
        <AssessmentsSection patientId={patientId} />
        <Stack gap="xs">
          <Title order={2} size="h3">
            {RECORDINGS.title}
          </Title>
          <ProblemNote error={recordings.error} />
          {recordings.data && <Recordings items={recordings.data.items} />}
        </Stack>
        <Programmes patientId={patientId} />
        <Stack gap="xs">
          <Title order={2} size="h3">
            {PATIENT.sessions}
          </Title>
          <ProblemNote error={sessions.error} />
          {sessions.items && <SessionTable items={sessions.items} />}
          <LoadMoreButton list={sessions} />
        </Stack>
        <DataSection patientId={patientId} />
        <Modal opened={editing} onClose={form.close} title={PATIENT.editing} size="lg">
          <PatientForm patient={who} onDone={form.close} />
        </Modal>
      </Stack>
    </RevealWhenLoaded>
  );
}

function Recordings({ items }: { items: Recording[] }) {
  if (items.length === 0) return <Text>{RECORDINGS.none}</Text>;
  return (
    <Table verticalSpacing="md" highlightOnHover>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{RECORDINGS.name}</Table.Th>
          <Table.Th>{RECORDINGS.taught}</Table.Th>
          <Table.Th>{RECORDINGS.side}</Table.Th>
          <Table.Th ta="right">{RECORDINGS.length}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((recording) => (
          <Table.Tr key={recording.id} {...(recording.archived_at && { c: "dimmed" })}>
            <Table.Td>
              <PageLink to="/recordings/$recordingId" params={{ recordingId: recording.id }}>
                {recording.name}
              </PageLink>
              {recording.archived_at && RECORDINGS.archived}
              {recording.parent_id && (
                <Text size="sm" c="dimmed">
                  {madeOf(recording, items)}
                </Text>
              )}
            </Table.Td>
            <Table.Td>{formatMoment(recording.taught_at)}</Table.Td>
            <Table.Td>{sideWord(recording.side)}</Table.Td>
            <Table.Td ta="right">{formatSpan(recording.duration_s)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
