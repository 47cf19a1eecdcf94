import { Stack, Text, Title } from "@mantine/core";
import type { Recording } from "../../lib/api/client";
import { formatDuration, formatMoment, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useRecordings } from "../../lib/patientQueries";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import type { Column } from "../../ui/tableRows";
import { describeOrigin } from "../recordings/describeOrigin";

/** A patient's recordings, including archived ones. */
export function RecordingsSection({ patientId }: { patientId: string }) {
  const recordings = useRecordings(patientId);
  return (
    <Stack gap="xs">
      <Title order={2} size="h3">
        {t("patients:recordings.title")}
      </Title>
      <ProblemNote error={recordings.error} />
      {recordings.data && <RecordingTable items={recordings.data.items} />}
    </Stack>
  );
}

function RecordingTable({ items }: { items: Recording[] }) {
  if (items.length === 0) return <Text>{t("patients:recordings.none")}</Text>;
  return (
    <DataTable
      name="recordings"
      label={t("patients:recordings.title")}
      columns={columnsOf(items)}
      rows={items}
      rowKey={({ id }) => id}
      rowName={({ name }) => name}
      isDimmed={({ archived_at }) => archived_at !== null}
    />
  );
}

const columnsOf = (items: Recording[]): Column<Recording>[] => [
  {
    key: "name",
    head: t("patients:recordings.name"),
    always: true,
    value: ({ name }) => name,
    cell: (recording) => (
      <>
        <PageLink to="/recordings/$recordingId" params={{ recordingId: recording.id }}>
          {recording.name}
        </PageLink>
        {recording.archived_at && t("patients:recordings.archived")}{" "}
        <SimulatedBadge simulated={recording.simulated} short />
        {recording.parent_id && (
          <Text size="sm" c="dimmed">
            {describeOrigin(recording, items)}
          </Text>
        )}
      </>
    ),
  },
  {
    key: "taught",
    head: t("patients:recordings.taught"),
    value: ({ taught_at }) => taught_at,
    cell: ({ taught_at }) => formatMoment(taught_at),
  },
  {
    key: "side",
    head: t("patients:recordings.side"),
    value: ({ side }) => formatSide(side),
    cell: ({ side }) => formatSide(side),
  },
  {
    key: "length",
    head: t("patients:recordings.length"),
    right: true,
    value: ({ duration_s }) => duration_s,
    cell: ({ duration_s }) => formatDuration(duration_s),
  },
];
