import "./catalogue";
import { Alert, Button, Modal, Skeleton, Stack, Text, Title } from "@mantine/core";
import { IconFileTypePdf, IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDayOf, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { LANGUAGE } from "../../lib/language";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { DataTable } from "../../ui/DataTable";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { ChartCard } from "../statistics/ChartCard";
import { DRIFT, type DriftName, driftFigure, driftTable, type Entry, measured } from "./driftCharts";
import { Responses } from "./Responses";
import { describeStepResult, StepResult, stepName, Values } from "./StepResult";

/** The records of a station with their drift. */
export function RecordsTab({ station }: { station: string }) {
  const records = usePagedQuery(["commissionings", station], (after) => api.commissionings(station, after));
  const [open, setOpen] = useState<Entry | null>(null);
  return (
    <Stack>
      <ProblemNote error={records.error} />
      {records.isPending && <Skeleton h={240} />}
      {records.items?.length === 0 && <Text>{t("commissioning:records.none")}</Text>}
      {records.items && records.items.length > 0 && (
        <>
          <RecordTable records={records.items} more={records.hasNextPage} onOpen={setOpen} />
          <LoadMoreButton list={records} words={t("commissioning:records.more")} />
          <Drift records={records.items} />
        </>
      )}
      {open && <StepsDialog record={open} onClose={() => setOpen(null)} />}
    </Stack>
  );
}

function RecordTable(props: { records: Entry[]; more: boolean; onOpen: (record: Entry) => void }) {
  return (
    <div data-testid="commissionings">
      <DataTable
        name="commissionings"
        label={t("commissioning:page.records")}
        columns={[...COLUMNS, filesColumn(props.onOpen)]}
        rows={props.records}
        rowKey={({ id }) => id}
        more={props.more}
      />
    </div>
  );
}

const COLUMNS: Column<Entry>[] = [
  {
    key: "when",
    head: t("commissioning:records.when"),
    always: true,
    value: ({ ended_at }) => ended_at,
    cell: ({ ended_at }) => formatMoment(ended_at),
  },
  {
    key: "kind",
    head: t("commissioning:records.kind"),
    value: ({ kind }) => t(`commissioning:kinds.${kind}`),
    cell: ({ kind }) => t(`commissioning:kinds.${kind}`),
  },
  {
    key: "who",
    head: t("commissioning:records.who"),
    value: ({ done_by }) => done_by,
    cell: ({ done_by }) => done_by,
  },
  {
    key: "result",
    head: t("commissioning:records.result"),
    value: (record) => describeStepResult(record),
    cell: (record) => <StepResult run={record} />,
  },
];

/** The column whose buttons open a record's steps and its PDF. */
const filesColumn = (onOpen: (record: Entry) => void): Column<Entry> => ({
  key: "files",
  head: t("commissioning:records.open"),
  right: true,
  always: true,
  cell: (record) => (
    <>
      <Button variant="default" size="sm" mr="xs" onClick={() => onOpen(record)}>
        {t("commissioning:records.steps")}
      </Button>
      <Button
        component="a"
        variant="default"
        size="sm"
        href={`/api/commissionings/${record.id}/report.pdf?language=${LANGUAGE}`}
        target="_blank"
        leftSection={<IconFileTypePdf size={18} />}
        aria-label={t("commissioning:records.pdfOf", { when: formatMoment(record.ended_at) })}
      >
        {t("commissioning:records.pdf")}
      </Button>
    </>
  ),
});

/** The charts of every figure that at least two records have measured. */
function Drift({ records }: { records: Entry[] }) {
  const shown = (Object.keys(DRIFT) as DriftName[])
    .map((name) => ({ name, own: measured(records, name) }))
    .filter(({ own }) => own.length > 1);
  return (
    <Stack component="section" aria-label={t("commissioning:drift.title")}>
      <Title order={2} size="h3">
        {t("commissioning:drift.title")}
      </Title>
      <Text size="sm">
        {shown.length > 0 ? t("commissioning:drift.explain") : t("commissioning:drift.none")}
      </Text>
      {shown.map(({ name, own }) => (
        <ChartCard
          key={name}
          name={name}
          title={t(`commissioning:drift.${name}`)}
          summary={t("commissioning:drift.summary", {
            count: own.length,
            first: formatDayOf(own[0]?.ended_at ?? ""),
            last: formatDayOf(own.at(-1)?.ended_at ?? ""),
          })}
          figure={driftFigure(own, name)}
          table={driftTable(own, name)}
        />
      ))}
    </Stack>
  );
}

/** Shows the steps of a record with the values before and after each step. */
function StepsDialog({ record, onClose }: { record: Entry; onClose: () => void }) {
  const detail = useQuery({
    queryKey: ["commissioning", record.id],
    queryFn: () => api.commissioning(record.id),
  });
  const title = t("commissioning:records.stepsOf", {
    kind: t(`commissioning:kinds.${record.kind}`),
    when: formatMoment(record.ended_at),
  });
  return (
    <Modal opened onClose={onClose} size="xl" title={title}>
      <Stack>
        <ProblemNote error={detail.error} />
        {detail.isPending && <Skeleton h={240} />}
        {detail.data?.steps.map((run) => (
          <Stack key={`${run.step} ${run.began_at}`} gap="xs" data-testid="step">
            <Title order={3} size="h5">
              {stepName(run.step)}
            </Title>
            <StepResult run={run} />
            {run.curves.length > 0 && <Responses responses={run.curves} />}
            {run.values.length > 0 && <Values values={run.values} />}
          </Stack>
        ))}
        {detail.data && <SignatureNote signature={detail.data.signature} />}
        <Text size="xs" c="dimmed" style={{ overflowWrap: "anywhere" }}>
          {t("commissioning:records.digest", { digest: record.digest })}
        </Text>
      </Stack>
    </Modal>
  );
}

/** Says whether the record is as the station has signed it. */
export function SignatureNote({ signature }: { signature: Schemas["CommissioningSignature"] }) {
  const { state, changed, public_key } = signature;
  if (state === "changed")
    return (
      <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
        {t("commissioning:records.signature.changed", { changed: changed.join(", ") })}
      </Alert>
    );
  return (
    <Text size="xs" c="dimmed" style={{ overflowWrap: "anywhere" }}>
      {t(`commissioning:records.signature.${state}`, { key: public_key })}
    </Text>
  );
}
