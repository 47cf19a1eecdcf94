import "./catalogue";
import {
  Alert,
  Badge,
  Button,
  Card,
  Group,
  List,
  Modal,
  Skeleton,
  Stack,
  Text,
  TextInput,
  Title,
} from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconArchive, IconInfoCircle, IconPencil } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, ProblemError, type Programme, type ProgrammeVersion } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useArchive } from "../../ui/archive";
import { ProblemNote } from "../../ui/ProblemNote";
import { RequirePermission } from "../auth/RequirePermission";
import { PatientBanner } from "../patients/PatientBanner";
import { changes, describeTimer, describeVersion, playingTimeS } from "./describeProgramme";
import { draftOf, type Wanted } from "./draft";
import { ItemTable } from "./ItemTable";
import { ProgrammeEditor } from "./ProgrammeEditor";
import { useSetProgrammeCache } from "./useSetProgrammeCache";

/** A programme with its versions and their reasons. */
export function ProgrammePage() {
  const { programmeId } = useParams({ from: "/programmes/$programmeId" });
  const programme = useQuery({
    queryKey: ["programme", programmeId],
    queryFn: () => api.programme(programmeId),
  });
  useTitle(programme.data?.name ?? t("programmes:programme.title"));
  if (programme.error) return <ProblemNote error={programme.error} />;
  if (!programme.data) return <Skeleton h={300} />;
  return <ProgrammeView programme={programme.data} />;
}

/** The current version with its actions. */
export function ProgrammeView({ programme }: { programme: Programme }) {
  const [editing, editor] = useDisclosure(false);
  const [renaming, name] = useDisclosure(false);
  const archive = useArchiveProgramme(programme);
  return (
    <Stack gap="xl">
      <PatientBanner patientId={programme.patient.id} name={programme.patient.name} link />
      <Group justify="space-between" align="start">
        <ProgrammeTitle programme={programme} />
        <RequirePermission permission="write_records">
          <Group>
            {!programme.archived_at && !programme.closed && !editing && (
              <Button leftSection={<IconPencil size={20} />} onClick={editor.open}>
                {t("programmes:programme.change")}
              </Button>
            )}
            <Button variant="default" onClick={name.open}>
              {t("programmes:programme.rename")}
            </Button>
            <Button
              variant="default"
              leftSection={<IconArchive size={20} />}
              loading={archive.isPending}
              onClick={() => archive.mutate(!programme.archived_at)}
            >
              {programme.archived_at ? t("programmes:programme.restore") : t("programmes:programme.archive")}
            </Button>
          </Group>
        </RequirePermission>
      </Group>
      <ProblemNote error={archive.error} />
      {programme.closed && <Text>{t("programmes:programme.closed")}</Text>}
      {editing ? (
        <VersionEditor programme={programme} onDone={editor.close} />
      ) : (
        <CurrentVersion version={programme.current} />
      )}
      <Stack gap="sm" component="section" aria-label={t("programmes:versions.title")}>
        <Title order={2} size="h3">
          {t("programmes:versions.title")}
        </Title>
        <Versions versions={programme.versions} />
      </Stack>
      <Modal opened={renaming} onClose={name.close} title={t("programmes:programme.renaming")}>
        <Rename programme={programme} onDone={name.close} />
      </Modal>
    </Stack>
  );
}

/** Archives and restores a programme. */
function useArchiveProgramme(programme: Programme) {
  const setProgrammeCache = useSetProgrammeCache();
  const save = async (archived: boolean, { id, updated_at }: Programme) => {
    const saved = await api.updateProgramme(id, { archived, updated_at });
    setProgrammeCache(saved);
    return saved;
  };
  return useArchive(programme, save);
}

function ProgrammeTitle({ programme }: { programme: Programme }) {
  return (
    <div>
      <Title order={1} size="h2">
        {programme.name}
      </Title>
      <Group gap="lg">
        <Text>{t(`programmes:programme.shoulder.${programme.side}`)}</Text>
        {programme.archived_at && <Badge color="gray">{t("programmes:programme.archived")}</Badge>}
      </Group>
    </div>
  );
}

function CurrentVersion({ version }: { version: ProgrammeVersion }) {
  const timerWarning = describeTimer(version.timer_minutes, playingTimeS(version.items));
  return (
    <Stack gap="xs" component="section" aria-label={t("programmes:programme.currentContents")}>
      <Text size="lg" fw={600}>
        {describeVersion(version)}
      </Text>
      {timerWarning && <Text>{timerWarning}</Text>}
      <ItemTable version={version} />
    </Stack>
  );
}

/**
 * Edits the next version. If another user has saved a version meanwhile, the input is kept and that version is
 * shown below.
 */
function VersionEditor({ programme, onDone }: { programme: Programme; onDone: () => void }) {
  const setProgrammeCache = useSetProgrammeCache();
  const [basedOn, setBasedOn] = useState(programme.current.number);
  const [start] = useState(() => draftOf(programme.current));
  const newest = programme.current.number;
  const save = async (wanted: Wanted) => {
    try {
      setProgrammeCache(await api.createProgrammeVersion(programme.id, { ...wanted, based_on: basedOn }));
    } catch (error) {
      if (error instanceof ProblemError && error.code === "edited_meanwhile") {
        setProgrammeCache(await api.programme(programme.id));
      }
      throw error;
    }
    onDone();
  };
  return (
    <>
      {newest > basedOn && (
        <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
          <Stack gap="xs" align="start">
            <Text>
              {t("programmes:versions.conflict", { by: programme.current.made_by, number: newest })}
            </Text>
            <Button variant="default" onClick={() => setBasedOn(newest)}>
              {t("programmes:versions.confirmRead", { number: newest })}
            </Button>
          </Stack>
        </Alert>
      )}
      <ProgrammeEditor
        patientId={programme.patient.id}
        episode={{ id: programme.episode_id, side: programme.side }}
        start={start}
        draftKey={`${programme.id} ${basedOn}`}
        saveLabel={t("programmes:versions.saveAs", { number: basedOn + 1 })}
        onSave={save}
        onCancel={onDone}
      />
    </>
  );
}

/** The versions with period, author, reason and changes. */
function Versions({ versions }: { versions: ProgrammeVersion[] }) {
  return versions.map((version, place) => (
    <Version key={version.id} version={version} before={versions[place + 1]} />
  ));
}

function Version({ version, before }: { version: ProgrammeVersion; before: ProgrammeVersion | undefined }) {
  const [open, { toggle }] = useDisclosure(false);
  return (
    <Card
      withBorder
      component="section"
      aria-label={t("programmes:versions.number", { number: version.number })}
    >
      <Stack gap="xs">
        <Group justify="space-between" align="start">
          <Title order={3} size="h4">
            {t("programmes:versions.heading", {
              number: version.number,
              moment: formatMoment(version.made_at),
              by: version.made_by,
            })}
          </Title>
          <Button variant="default" aria-expanded={open} onClick={toggle}>
            {open
              ? t("programmes:versions.hide", { number: version.number })
              : t("programmes:versions.show", { number: version.number })}
          </Button>
        </Group>
        {version.note && <Text style={{ whiteSpace: "pre-wrap" }}>{version.note}</Text>}
        {before && (
          <List data-testid={`changes-${version.number}`}>
            {changes(before, version).map((change) => (
              <List.Item key={change}>{change}</List.Item>
            ))}
          </List>
        )}
        {open && (
          <>
            <Text>{describeVersion(version)}</Text>
            <ItemTable version={version} />
          </>
        )}
      </Stack>
    </Card>
  );
}

function Rename({ programme, onDone }: { programme: Programme; onDone: () => void }) {
  const setProgrammeCache = useSetProgrammeCache();
  const [name, setName] = useState(programme.name);
  const save = useMutation({
    mutationFn: () => api.updateProgramme(programme.id, { name, updated_at: programme.updated_at }),
    onSuccess: (saved) => {
      setProgrammeCache(saved);
      onDone();
    },
  });
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        save.mutate();
      }}
      noValidate
    >
      <Stack>
        <TextInput
          label={t("programmes:programme.name")}
          required
          data-autofocus
          value={name}
          error={fields.name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <ProblemNote error={save.error} />
        <Button type="submit" loading={save.isPending}>
          {t("programmes:programme.save")}
        </Button>
      </Stack>
    </form>
  );
}
