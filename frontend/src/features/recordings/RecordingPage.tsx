import "./catalogue";
import { ActionIcon, Badge, Button, Group, Skeleton, Stack, Text, TextInput, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconAdjustments, IconArchive, IconCheck, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { type UseMutationResult, useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useNavigate, useParams } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatDuration, formatList, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { replaceData } from "../../lib/replaceData";
import { offerRestore } from "../../ui/archive";
import { EditableNote } from "../../ui/EditableNote";
import { InlineSlot } from "../../ui/InlineSlot";
import { ButtonLink, PageLink } from "../../ui/links";
import { MotorRanges } from "../../ui/MotorRanges";
import { ProblemNote } from "../../ui/ProblemNote";
import { ReachMargin } from "../../ui/ReachMargin";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { useHasPermission } from "../auth/hooks";
import { RecordingGhost } from "../digital-twin/lazyViews";
import { SampleLinks } from "../import-export/SampleLinks";
import { PatientBanner } from "../patients/PatientBanner";
import { RecordingRhythm } from "../rhythm/lazyRhythm";
import { describeEdits } from "./describeOrigin";
import { EditPanel } from "./EditPanel";
import { RecordingFigure } from "./RecordingFigure";

type Detail = Schemas["RecordingDetail"];
type Update = UseMutationResult<Detail, Error, Schemas["RecordingUpdate"]>;
/**
 * A name during typing, and the version at which editing began, because another user may save a newer name
 * meanwhile.
 */
type Renaming = { name: string; version: string };

/** Return a mutation that changes name, note or archiving of a recording. Archiving can be undone. */
function useUpdateRecording(recordingId: string, onSaved: () => void): Update {
  const queries = useQueryClient();
  const save = async (change: Schemas["RecordingUpdate"]) => {
    const saved = await api.updateRecording(recordingId, change);
    replaceData(queries, ["recording", recordingId], saved);
    void queries.invalidateQueries({ queryKey: ["recordings"] });
    return saved;
  };
  return useMutation({
    mutationFn: save,
    onError: () => void queries.invalidateQueries({ queryKey: ["recording", recordingId] }),
    onSuccess: (saved, change) => {
      onSaved();
      if (!change.archived) return;
      offerRestore(saved.name, () => save({ archived: false, updated_at: saved.updated_at }));
    },
  });
}

/** A recording with its details, motor ranges and curves. */
export function RecordingPage() {
  const { recordingId } = useParams({ from: "/recordings/$recordingId" });
  const queries = useQueryClient();
  const navigate = useNavigate();
  const [renaming, setRenaming] = useState<Renaming | null>(null);
  const [editing, panel] = useDisclosure(false);
  const recording = useQuery({
    queryKey: ["recording", recordingId],
    queryFn: () => api.recording(recordingId),
  });
  const parentId = recording.data?.parent_id ?? null;
  const parent = useQuery({
    queryKey: ["recording", parentId],
    queryFn: () => api.recording(parentId ?? ""),
    enabled: parentId !== null,
  });
  const update = useUpdateRecording(recordingId, () => setRenaming(null));
  useTitle(recording.data?.name ?? t("recordings:recording.title"));
  if (recording.error) return <ProblemNote error={recording.error} />;
  if (!recording.data) return <Skeleton h={300} />;
  const shown = recording.data;
  return (
    <Stack>
      <PatientBanner patientId={shown.patient_id} link />
      <Group justify="space-between" align="start">
        <Name recording={shown} renaming={renaming} onRenaming={setRenaming} update={update} />
        <Actions recording={shown} editing={editing} onEdit={panel.toggle} update={update} />
      </Group>
      <Facts recording={shown} />
      {shown.parent_id && <Origin recording={shown} parentId={shown.parent_id} parent={parent.data?.name} />}
      <ProblemNote error={update.error} />
      {editing && (
        <EditPanel
          key={shown.id}
          recording={shown}
          onSaved={(derived) => {
            panel.close();
            void queries.invalidateQueries({ queryKey: ["recordings"] });
            void navigate({ to: "/recordings/$recordingId", params: { recordingId: derived.id } });
          }}
        />
      )}
      {!shown.readable && <Text fw={600}>{t("recordings:recording.damaged")}</Text>}
      <EditableNote
        label={t("recordings:recording.note")}
        value={shown.note}
        version={shown.updated_at}
        save={(note, version) => update.mutateAsync({ note, updated_at: version })}
      />
      {shown.ranges.length > 0 && <MotorRanges ranges={shown.ranges} />}
      {shown.margin && <ReachMargin margin={shown.margin} />}
      {shown.readable && <RecordingGhost key={`ghost-${recordingId}`} recordingId={recordingId} />}
      {shown.readable && <RecordingRhythm key={`rhythm-${recordingId}`} recordingId={recordingId} />}
      {shown.readable && <RecordingFigure key={recordingId} recordingId={recordingId} />}
    </Stack>
  );
}

/** Shows the name, and the form that changes it. */
function Name(props: {
  recording: Detail;
  renaming: Renaming | null;
  onRenaming: (renaming: Renaming) => void;
  update: Update;
}) {
  const { recording, renaming, onRenaming, update } = props;
  const writes = useHasPermission("write_records");
  if (renaming === null)
    return (
      <Group gap="xs">
        <Title order={1} size="h2">
          {recording.name}
        </Title>
        {writes && (
          <ActionIcon
            variant="subtle"
            size={44}
            aria-label={t("recordings:recording.rename")}
            onClick={() => onRenaming({ name: recording.name, version: recording.updated_at })}
          >
            <IconPencil size={20} />
          </ActionIcon>
        )}
      </Group>
    );
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        update.mutate({ name: renaming.name, updated_at: renaming.version });
      }}
    >
      <Group gap="xs">
        <TextInput
          aria-label={t("recordings:recording.name")}
          w={360}
          value={renaming.name}
          onChange={(event) => onRenaming({ ...renaming, name: event.currentTarget.value })}
        />
        <ActionIcon
          type="submit"
          size={44}
          aria-label={t("recordings:recording.saveName")}
          loading={update.isPending}
        >
          <IconCheck size={20} />
        </ActionIcon>
      </Group>
    </form>
  );
}

function Actions(props: { recording: Detail; editing: boolean; onEdit: () => void; update: Update }) {
  const { recording, editing, update } = props;
  const writes = useHasPermission("write_records");
  const operates = useHasPermission("operate");
  const usable = !recording.archived_at && recording.readable;
  return (
    <Group>
      {operates && usable && (
        <ButtonLink
          to="/station"
          search={{ patient: recording.patient_id, recording: recording.id }}
          leftSection={<IconPlayerPlay size={20} />}
        >
          {t("recordings:recording.play")}
        </ButtonLink>
      )}
      {writes && usable && (
        <Button
          variant="default"
          leftSection={<IconAdjustments size={20} />}
          aria-expanded={editing}
          onClick={props.onEdit}
        >
          {t("recordings:recording.edit")}
        </Button>
      )}
      <SampleLinks of="recordings" id={recording.id} disabled={!recording.readable} />
      {writes && (
        <Button
          variant="default"
          leftSection={<IconArchive size={20} />}
          onClick={() =>
            update.mutate({ archived: !recording.archived_at, updated_at: recording.updated_at })
          }
        >
          {recording.archived_at ? t("recordings:recording.restore") : t("recordings:recording.archive")}
        </Button>
      )}
    </Group>
  );
}

function Facts({ recording }: { recording: Detail }) {
  return (
    <Group gap="lg">
      <Text>
        {recording.parent_id
          ? t("recordings:recording.made", { when: formatMoment(recording.taught_at) })
          : t("recordings:recording.taught", { when: formatMoment(recording.taught_at) })}
      </Text>
      <Text>{t(`recordings:recording.shoulder.${recording.side === "left" ? "left" : "right"}`)}</Text>
      <Text>
        {recording.parent_id
          ? t("recordings:recording.length", {
              lasts: formatDuration(recording.duration_s),
              samples: recording.samples,
            })
          : t("recordings:recording.lengthAt", {
              lasts: formatDuration(recording.duration_s),
              samples: recording.samples,
              hz: recording.rate_hz,
            })}
      </Text>
      <Text>{recording.station}</Text>
      <SimulatedBadge simulated={recording.simulated} />
      {recording.taught_by && <Text>{t("recordings:recording.taughtBy", { who: recording.taught_by })}</Text>}
      {recording.fixtures.length > 0 && (
        <Text>
          {t("recordings:recording.fixtures", {
            fixtures: recording.fixtures.map((fixture) => t(`common:fixtures.${fixture}`)),
          })}
        </Text>
      )}
      {recording.archived_at && <Badge color="gray">{t("recordings:recording.archived")}</Badge>}
    </Group>
  );
}

/** Shows the recording from which this one was derived, and the edits. */
function Origin(props: { recording: Detail; parentId: string; parent: string | undefined }) {
  const { recording, parentId, parent } = props;
  return (
    <Text data-testid="made-of">
      <InlineSlot
        words={(link) =>
          t("recordings:recording.madeOf", { parent: link, done: formatList(describeEdits(recording)) })
        }
      >
        <PageLink to="/recordings/$recordingId" params={{ recordingId: parentId }}>
          {parent ?? t("recordings:recording.another")}
        </PageLink>
      </InlineSlot>
    </Text>
  );
}
