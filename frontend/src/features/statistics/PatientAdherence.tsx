import { Skeleton, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { describeAdherence, sumsOf } from "./adherence";
import { describeSpan } from "./figuresSearch";
import { wholePercent } from "./outcomeFormat";

type Row = Schemas["PatientAdherence"];
const NONE: Schemas["PatientAdherences"] = { rows: [], count: 0, first_day: "", last_day: "" };

/** Lists the patients with a followed programme, the lowest share of held sessions first. */
export function PatientAdherence() {
  const adherence = useQuery({ queryKey: ["patient-adherence"], queryFn: api.patientAdherence });
  const { rows, count, ...days } = adherence.data ?? NONE;
  return (
    <Stack>
      <ProblemNote error={adherence.error} />
      {adherence.isPending && <Skeleton h={400} />}
      {adherence.data && (
        <Text size="sm">
          {rows.length < count
            ? t("statistics:figures.adherenceProgrammes", {
                days: describeSpan({ from: days.first_day, to: days.last_day }),
                count,
              })
            : describeAdherence({ ...days, ...sumsOf(rows, days.last_day) })}
        </Text>
      )}
      {adherence.data && rows.length === 0 && <Text>{t("statistics:figures.noProgrammes")}</Text>}
      {rows.length > 0 && (
        <DataTable
          name="adherence"
          label={t("statistics:subjects.adherence.title")}
          columns={COLUMNS}
          rows={rows}
          rowKey={({ patient, due_at }) => `${patient.id} ${due_at}`}
          more={rows.length < count}
        />
      )}
    </Stack>
  );
}

/** Return held of prescribed sessions, at most 1. Null: none has been prescribed yet. */
export const shareOf = ({ held, prescribed }: Pick<Row, "held" | "prescribed">): number | null =>
  prescribed > 0 ? Math.min(1, held / prescribed) : null;

const percentText = (share: number | null) =>
  share === null ? "–" : t("statistics:figures.percent", { value: wholePercent(share) });

/** Return the share of all rows in words. */
export const shareOfAll = (rows: Pick<Row, "held" | "prescribed" | "due_at">[]) =>
  percentText(shareOf(sumsOf(rows, "")));

const percentOf = (row: Row): number | null => {
  const share = shareOf(row);
  return share === null ? null : Number(wholePercent(share));
};

const COLUMNS: Column<Row>[] = [
  {
    key: "patient",
    head: t("statistics:figures.patient"),
    always: true,
    value: ({ patient }) => patient.name,
    cell: ({ patient }) => (
      <PageLink to="/patients/$patientId" params={{ patientId: patient.id }} search={{ tab: "programmes" }}>
        {patient.name}
      </PageLink>
    ),
  },
  {
    key: "share",
    head: t("statistics:figures.heldShare"),
    right: true,
    value: percentOf,
    cell: (row) => percentText(shareOf(row)),
    total: shareOfAll,
  },
  {
    key: "held",
    onWide: true,
    head: t("statistics:figures.held"),
    right: true,
    noTotal: t("statistics:figures.noTotalHeld"),
    value: ({ held }) => held,
    cell: ({ held }) => held,
  },
  {
    key: "prescribed",
    onWide: true,
    head: t("statistics:figures.prescribed"),
    right: true,
    total: true,
    value: ({ prescribed }) => prescribed,
    cell: ({ prescribed }) => prescribed,
  },
  {
    key: "last",
    onWide: true,
    head: t("statistics:figures.lastSession"),
    value: ({ last_session_at }) => last_session_at,
    cell: ({ last_session_at }) => (last_session_at ? formatDayOf(last_session_at) : "–"),
  },
  {
    key: "due",
    head: t("statistics:figures.nextDue"),
    value: ({ due_at }) => due_at,
    cell: ({ due_at }) => formatDayOf(due_at),
  },
  {
    key: "therapist",
    onWide: true,
    head: t("sessions:sessions.therapist"),
    value: ({ therapist }) => therapist,
    cell: ({ therapist }) => therapist || "–",
  },
];
