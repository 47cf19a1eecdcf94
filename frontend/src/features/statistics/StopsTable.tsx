import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import type { Column } from "../../ui/tableRows";
import { useHasPermission } from "../auth/hooks";
import { describeStop } from "../sessions/describeStop";

type Row = Schemas["StopCount"];
type Days = { from: string; to: string };

/** Shows the causes by station. For users who may read records, each links to its sessions. */
export function StopsTable({ rows, days }: { rows: Row[]; days: Days }) {
  const canReadRecords = useHasPermission("read_records");
  return (
    <DataTable
      name="stops"
      label={t("statistics:subjects.stops.title")}
      columns={[causeColumn(days, canReadRecords), ...COUNTS]}
      rows={rows}
      rowKey={({ code, station }) => `${code} ${station}`}
      dense
    />
  );
}

const causeColumn = (days: Days, canReadRecords: boolean): Column<Row> => ({
  key: "cause",
  head: t("statistics:figures.cause"),
  always: true,
  value: ({ code }) => describeStop(code),
  cell: ({ code, station, sessions }) =>
    canReadRecords && sessions > 0 ? (
      <PageLink to="/sessions" search={{ stop: code, ...(station && { station }), ...days }}>
        {describeStop(code)}
      </PageLink>
    ) : (
      describeStop(code)
    ),
});

const COUNTS: Column<Row>[] = [
  {
    key: "station",
    below: "cause",
    head: t("statistics:figures.station"),
    value: ({ station }) => station || null,
    cell: ({ station }) => station || "–",
  },
  {
    key: "sessions",
    head: t("statistics:figures.counted.sessions"),
    right: true,
    noTotal: t("statistics:figures.noTotalStopped"),
    value: ({ sessions }) => sessions,
    cell: ({ sessions }) => sessions,
  },
  {
    key: "alarms",
    head: t("statistics:figures.alarms"),
    right: true,
    total: true,
    value: ({ alarms }) => alarms,
    cell: ({ alarms }) => alarms,
  },
];
