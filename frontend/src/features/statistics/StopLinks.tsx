import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import type { Column } from "../../ui/tableRows";
import { useHasPermission } from "../auth/hooks";
import { stopWords } from "../sessions/stopWords";

type Row = Schemas["StopCount"];
type Days = { from: string; to: string };

/** Shows the causes by station. For users who may read records, each links to its sessions. */
export function StopLinks({ rows, days }: { rows: Row[]; days: Days }) {
  const reads = useHasPermission("read_records");
  return (
    <DataTable
      name="stops"
      label={t("clinic:subjects.stops.title")}
      columns={[causeColumn(days, reads), ...COUNTS]}
      rows={rows}
      rowKey={({ code, station }) => `${code} ${station}`}
      dense
    />
  );
}

const causeColumn = (days: Days, reads: boolean): Column<Row> => ({
  key: "cause",
  head: t("clinic:figures.cause"),
  always: true,
  value: ({ code }) => stopWords(code),
  cell: ({ code, station, sessions }) =>
    reads && sessions > 0 ? (
      <PageLink to="/sessions" search={{ stop: code, ...(station && { station }), ...days }}>
        {stopWords(code)}
      </PageLink>
    ) : (
      stopWords(code)
    ),
});

const COUNTS: Column<Row>[] = [
  {
    key: "station",
    head: t("clinic:figures.station"),
    value: ({ station }) => station || null,
    cell: ({ station }) => station || "–",
  },
  {
    key: "sessions",
    head: t("clinic:figures.sessions"),
    right: true,
    value: ({ sessions }) => sessions,
    cell: ({ sessions }) => sessions,
  },
  {
    key: "alarms",
    head: t("clinic:figures.alarms"),
    right: true,
    total: true,
    value: ({ alarms }) => alarms,
    cell: ({ alarms }) => alarms,
  },
];
