import { Badge, Button, Group, Modal, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconArchive, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Patient, ProblemError, type Recording } from "../../lib/api/client";
import { formatDay, formatMoment, formatSpan, sideWord } from "../../lib/format";
import { t } from "../../lib/i18n";
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

/** One patient: the record, the recordings and the sessions. */
export function PatientPage() {
  const { patientId } = useParams({ from: "/patients/$patientId" });
  const [editing, form] = useDisclosure(false);
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  const recordings = useRecordings(patientId);
  const sessions = usePagedQuery(["sessions", "of", patientId], (after) =>
    api.patientSessions(patientId, after),
  );
  useTitle(patient.data?.name ?? t("patients:patient.title"));
  if (patient.error instanceof ProblemError && patient.error.code === "restricted") {
    return <BreakGlass patientId={patientId} />;
  }
  if (patient.error) return <ProblemNote error={patient.error} />;
  if (!patient.data) return <Skeleton h={300} />;
  const record = patient.data;
  return (
    <RevealWhenLoaded>
      <Stack gap="xl">
        {record.restricted && <GlassBanner patientId={patientId} />}
        <Header patient={record} onEdit={form.open} />
        <Episodes patient={record} />
        <AssessmentsSection patientId={patientId} />
        <Stack gap="xs">
          <Title order={2} size="h3">
            {t("patients:recordings.title")}
          </Title>
          <ProblemNote error={recordings.error} />
          {recordings.data && <Recordings items={recordings.data.items} />}
        </Stack>
        <Programmes patientId={patientId} />
        <Stack gap="xs">
          <Title order={2} size="h3">
            {t("patients:patient.sessions")}
          </Title>
          <ProblemNote error={sessions.error} />
          {sessions.items && <SessionTable items={sessions.items} />}
          <LoadMoreButton list={sessions} />
        </Stack>
        <DataSection patientId={patientId} />
        <Modal opened={editing} onClose={form.close} title={t("patients:patient.editing")} size="lg">
          <PatientForm patient={record} onDone={form.close} />
        </Modal>
      </Stack>
    </RevealWhenLoaded>
  );
}

/** The patient's data and the actions on the record. */
function Header(props: { patient: Patient; onEdit: () => void }) {
  const { patient } = props;
  const writes = useHasPermission("write_records");
  const operates = useHasPermission("operate");
  const queries = useQueryClient();
  const archive = useMutation({
    mutationFn: (archived: boolean) =>
      api.updatePatient(patient.id, { archived, updated_at: patient.updated_at }),
    onSuccess: (saved) => {
      replaceData(queries, ["patient", patient.id], saved);
      void queries.invalidateQueries({ queryKey: ["patients"] });
    },
  });
  return (
    <Stack gap="xs">
      <Group justify="space-between" align="start">
        <div>
          <Title order={1} size="h2">
            {patient.name}
          </Title>
          {patient.kana && (
            <Text c="dimmed" lang="ja">
              {patient.kana}
            </Text>
          )}
        </div>
        <Group>
          {operates && !patient.archived_at && (
            <ButtonLink to="/" search={{ patient: patient.id }} leftSection={<IconPlayerPlay size={20} />}>
              {t("patients:patient.toStation")}
            </ButtonLink>
          )}
          {writes && !patient.erased_at && (
            <>
              <Button variant="default" leftSection={<IconPencil size={20} />} onClick={props.onEdit}>
                {t("patients:patient.edit")}
              </Button>
              <Button
                variant="default"
                leftSection={<IconArchive size={20} />}
                loading={archive.isPending}
                onClick={() => archive.mutate(!patient.archived_at)}
              >
                {patient.archived_at ? t("patients:patient.restore") : t("patients:patient.archive")}
              </Button>
            </>
          )}
        </Group>
      </Group>
      <Group gap="lg">
        <Text>{t("patients:patient.number", { number: patient.clinic_number })}</Text>
        {patient.dominant_side && <Text>{t(`patients:patient.handed.${patient.dominant_side}`)}</Text>}
        {patient.birth_date && (
          <Text>{t("patients:patient.born", { day: formatDay(patient.birth_date) })}</Text>
        )}
        {patient.archived_at && (
          <Badge color="gray">
            {patient.erased_at ? t("patients:patient.erased") : t("patients:patient.archived")}
          </Badge>
        )}
      </Group>
      {patient.notes && <Text style={{ whiteSpace: "pre-wrap" }}>{patient.notes}</Text>}
      <RecordAccess patientId={patient.id} />
      <ProblemNote error={archive.error} />
    </Stack>
  );
}

function Recordings({ items }: { items: Recording[] }) {
  if (items.length === 0) return <Text>{t("patients:recordings.none")}</Text>;
  return (
    <Table verticalSpacing="md" highlightOnHover>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("patients:recordings.name")}</Table.Th>
          <Table.Th>{t("patients:recordings.taught")}</Table.Th>
          <Table.Th>{t("patients:recordings.side")}</Table.Th>
          <Table.Th ta="right">{t("patients:recordings.length")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((recording) => (
          <Table.Tr key={recording.id} {...(recording.archived_at && { c: "dimmed" })}>
            <Table.Td>
              <PageLink to="/recordings/$recordingId" params={{ recordingId: recording.id }}>
                {recording.name}
              </PageLink>
              {recording.archived_at && t("patients:recordings.archived")}
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
