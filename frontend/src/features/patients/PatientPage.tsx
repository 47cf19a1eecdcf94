import { Badge, Button, Group, Modal, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconArchive, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useNavigate, useParams, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Patient, ProblemError } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { patientOf } from "../../lib/patientQueries";
import { replaceData } from "../../lib/replaceData";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { useArchive } from "../../ui/archive";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ButtonLink } from "../../ui/links";
import { PageTabs } from "../../ui/PageTabs";
import { ProblemNote } from "../../ui/ProblemNote";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { AssessmentsSection } from "../assessments/AssessmentsSection";
import { BreakGlassAccessBanner, BreakGlassAccessForm } from "../auth/BreakGlassAccess";
import { useHasPermission } from "../auth/hooks";
import { RecordAccess } from "../auth/RecordAccess";
import { Episodes } from "../episodes/Episodes";
import { DataSection } from "../import-export/DataSection";
import { Programmes } from "../programmes/Programmes";
import { SessionTable } from "../sessions/SessionTable";
import { Contraindications } from "./Contraindications";
import { PatientBanner } from "./PatientBanner";
import { PatientForm } from "./PatientForm";
import { type PatientTab, readPatientTab } from "./patientTabs";
import { RecordingsSection } from "./RecordingTable";
import { PatientSummary } from "./summary/PatientSummary";

/** One patient: a summary, then the record in tabs. */
export function PatientPage() {
  const { patientId } = useParams({ from: "/patients/$patientId" });
  const { tab = "summary" } = useSearch({ from: "/patients/$patientId" });
  const navigate = useNavigate({ from: "/patients/$patientId" });
  const [editing, form] = useDisclosure(false);
  const patient = useQuery(patientOf(patientId));
  useTitle(patient.data?.name ?? t("patients:patient.title"));
  if (patient.error instanceof ProblemError && patient.error.code === "restricted") {
    return <BreakGlassAccessForm patientId={patientId} />;
  }
  if (patient.error) return <ProblemNote error={patient.error} />;
  if (!patient.data) return <Skeleton h={300} />;
  const record = patient.data;
  const open = (next: PatientTab) => void navigate({ search: readPatientTab({ tab: next }) });
  return (
    <RevealWhenLoaded>
      <Stack gap="sm">
        {record.restricted && <BreakGlassAccessBanner patientId={patientId} />}
        <PatientBanner patientId={patientId} name={record.name} heading more={<Facts patient={record} />} />
        <PageTabs
          label={t("patients:patient.title")}
          value={tab}
          names={t("patients:tabs", { returnObjects: true })}
          onChange={open}
          actions={<Actions patient={record} onEdit={form.open} />}
        >
          {(shown) => <TabContent patient={record} tab={shown} />}
        </PageTabs>
        <Modal opened={editing} onClose={form.close} title={t("patients:patient.editing")} size="lg">
          <PatientForm patient={record} onDone={form.close} />
        </Modal>
      </Stack>
    </RevealWhenLoaded>
  );
}

function TabContent({ patient, tab }: { patient: Patient; tab: PatientTab }) {
  switch (tab) {
    case "summary":
      return <PatientSummary patient={patient} />;
    case "episodes":
      return (
        <Stack gap="xl">
          <Contraindications patientId={patient.id} />
          <Episodes patient={patient} />
        </Stack>
      );
    case "assessments":
      return <AssessmentsSection patientId={patient.id} />;
    case "recordings":
      return <RecordingsSection patientId={patient.id} />;
    case "programmes":
      return <Programmes patientId={patient.id} />;
    case "sessions":
      return <Sessions patientId={patient.id} />;
    case "data":
      return (
        <Stack gap="xl">
          <RecordAccess patientId={patient.id} />
          <DataSection patientId={patient.id} />
        </Stack>
      );
  }
}

function Sessions({ patientId }: { patientId: string }) {
  const sessions = usePagedQuery(["sessions", "of", patientId], (after, limit) =>
    api.patientSessions(patientId, after, limit),
  );
  return (
    <Stack gap="xs">
      <Title order={2} size="h3">
        {t("patients:patient.sessions")}
      </Title>
      <ProblemNote error={sessions.error} />
      {sessions.items && (
        <SessionTable items={sessions.items} more={sessions.hasNextPage} fetchAll={sessions.fetchAll} />
      )}
      <LoadMoreButton list={sessions} />
    </Stack>
  );
}

/** What the banner shows on this page only. */
function Facts({ patient }: { patient: Patient }) {
  return (
    <>
      {patient.dominant_side && <Text>{t(`patients:patient.handed.${patient.dominant_side}`)}</Text>}
      {patient.archived_at && (
        <Badge color="gray">
          {patient.erased_at ? t("patients:patient.erased") : t("patients:patient.archived")}
        </Badge>
      )}
    </>
  );
}

/** The actions on the record. */
function Actions(props: { patient: Patient; onEdit: () => void }) {
  const { patient } = props;
  const writes = useHasPermission("write_records");
  const operates = useHasPermission("operate");
  const archive = useArchivePatient(patient);
  return (
    <>
      <Group gap="xs">
        {operates && !patient.archived_at && (
          <ButtonLink
            to="/station"
            search={{ patient: patient.id }}
            leftSection={<IconPlayerPlay size={20} />}
          >
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
      <ProblemNote error={archive.error} />
    </>
  );
}

/** Archives and restores the record. */
function useArchivePatient(patient: Patient) {
  const queries = useQueryClient();
  const save = async (archived: boolean, { id, updated_at }: Patient) => {
    const saved = await api.updatePatient(id, { archived, updated_at });
    replaceData(queries, ["patient", id], saved);
    void queries.invalidateQueries({ queryKey: ["patients"] });
    return saved;
  };
  return useArchive(patient, save);
}
