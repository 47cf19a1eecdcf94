import { ActionIcon, Badge, Button, Group, Skeleton, Stack, Text, TextInput, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconAdjustments, IconArchive, IconCheck, IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useNavigate, useParams } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatList, formatMoment, formatSpan } from "../../lib/format";
import { t } from "../../lib/i18n";
import { replaceData } from "../../lib/replaceData";
import { EditableNote } from "../../ui/EditableNote";
import { InlineSlot } from "../../ui/InlineSlot";
import { ButtonLink, PageLink } from "../../ui/links";
import { MotorRanges } from "../../ui/MotorRanges";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { RecordingGhost } from "../digital-twin/lazyViews";
import { SampleLinks } from "../import-export/SampleLinks";
import { EditPanel } from "./EditPanel";
import { doneWords } from "./madeOf";
import { RecordingFigure } from "./RecordingFigure";

/** A recording with its details, motor ranges and curves. */
export function RecordingPage() {
  const { recordingId } = useParams({ from: "/recordings/$recordingId" });
  const writes = useHasPermission("write_records");
  const operates = useHasPermission("operate");
  const queries = useQueryClient();
  const navigate = useNavigate();
  // The version at which editing began. Another user may save a newer name meanwhile.
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
      replaceData(queries, ["recording", recordingId], saved);
      void queries.invalidateQueries({ queryKey: ["recordings"] });
    },
  });
  useTitle(recording.data?.name ?? t("recordings:recording.title"));
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
                aria-label={t("recordings:recording.rename")}
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
                aria-label={t("recordings:recording.name")}
                w={360}
                value={renamed.name}
                onChange={(event) => setRenamed({ ...renamed, name: event.currentTarget.value })}
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
        )}
        <Group>
          {operates && !it.archived_at && it.readable && (
            <ButtonLink
              to="/"
              search={{ patient: it.patient_id, recording: it.id }}
              leftSection={<IconPlayerPlay size={20} />}
            >
              {t("recordings:recording.play")}
            </ButtonLink>
          )}
          {writes && !it.archived_at && it.readable && (
            <Button
              variant="default"
              leftSection={<IconAdjustments size={20} />}
              aria-expanded={editing}
              onClick={panel.toggle}
            >
              {t("recordings:recording.edit")}
            </Button>
          )}
          <SampleLinks of="recordings" id={it.id} disabled={!it.readable} />
          {writes && (
            <Button
              variant="default"
              leftSection={<IconArchive size={20} />}
              onClick={() => update.mutate({ archived: !it.archived_at, updated_at: it.updated_at })}
            >
              {it.archived_at ? t("recordings:recording.restore") : t("recordings:recording.archive")}
            </Button>
          )}
        </Group>
      </Group>
      <Group gap="lg">
        <Text>
          {it.parent_id
            ? t("recordings:recording.made", { when: formatMoment(it.taught_at) })
            : t("recordings:recording.taught", { when: formatMoment(it.taught_at) })}
        </Text>
        <Text>{t(`recordings:recording.shoulder.${it.side === "left" ? "left" : "right"}`)}</Text>
        <Text>
          {it.parent_id
            ? t("recordings:recording.length", { lasts: formatSpan(it.duration_s), samples: it.samples })
            : t("recordings:recording.lengthAt", {
                lasts: formatSpan(it.duration_s),
                samples: it.samples,
                hz: it.rate_hz,
              })}
        </Text>
        <Text>{it.station}</Text>
        {it.taught_by && <Text>{t("recordings:recording.taughtBy", { who: it.taught_by })}</Text>}
        {it.fixtures.length > 0 && (
          <Text>
            {t("recordings:recording.fixtures", {
              fixtures: it.fixtures.map((one) => t(`common:fixtures.${one}`)),
            })}
          </Text>
        )}
        {it.archived_at && <Badge color="gray">{t("recordings:recording.archived")}</Badge>}
      </Group>
      {it.parent_id && (
        <Text data-testid="made-of">
          <InlineSlot
            words={(parent) => t("recordings:recording.madeOf", { parent, done: formatList(doneWords(it)) })}
          >
            <PageLink to="/recordings/$recordingId" params={{ recordingId: it.parent_id }}>
              {parent.data?.name ?? t("recordings:recording.another")}
            </PageLink>
          </InlineSlot>
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
      {!it.readable && <Text fw={600}>{t("recordings:recording.damaged")}</Text>}
      <EditableNote
        label={t("recordings:recording.note")}
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
