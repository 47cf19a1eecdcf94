import { Badge, Skeleton, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { changeAsShown, ERROR_DIGITS, formatError } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { ChartCard } from "./ChartCard";
import { trackingFigure, trackingTable } from "./charts";
import { describeDrift } from "./drift";
import { daysOf, describeSpan, type FiguresSearch, spanOf } from "./figuresSearch";

/** Shows the tracking error of the stations by week, and whether it increases. */
export function Tracking({ search }: { search: FiguresSearch }) {
  const span = spanOf(search, new Date());
  const tracking = useQuery({ queryKey: ["tracking", span], queryFn: () => api.trackingQuality(span) });
  const rows = tracking.data?.rows ?? [];
  const drift = tracking.data?.drift ?? [];
  const leftOut = tracking.data?.left_out ?? 0;
  return (
    <Stack>
      <ProblemNote error={tracking.error} />
      {tracking.isPending && <Skeleton h={620} />}
      {tracking.data && rows.length === 0 && <Text>{t("statistics:figures.nothing")}</Text>}
      {rows.length > 0 && (
        <>
          <Drift drift={drift} />
          <ChartCard
            name="tracking"
            title={t("statistics:subjects.tracking.title")}
            summary={t("statistics:figures.trackingSummary", {
              days: describeSpan(daysOf(search, new Date())),
              drift: describeDrift(drift),
            })}
            figure={trackingFigure(rows)}
            table={trackingTable(rows)}
          />
        </>
      )}
      {leftOut > 0 && <Text size="sm">{t("statistics:figures.leftOut", { count: leftOut })}</Text>}
    </Stack>
  );
}

type Station = Schemas["StationDrift"];

function Drift({ drift }: { drift: Station[] }) {
  return (
    <div data-testid="drift">
      <DataTable
        name="drift"
        label={t("statistics:figures.trackingDetail")}
        columns={DRIFT_COLUMNS}
        rows={drift}
        rowKey={({ station }) => station}
        dense
      />
    </div>
  );
}

const DRIFT_COLUMNS: Column<Station>[] = [
  {
    key: "station",
    head: t("statistics:figures.station"),
    always: true,
    value: ({ station }) => station,
    cell: ({ station }) => station,
  },
  {
    key: "drift",
    head: t("statistics:figures.drift"),
    value: describeState,
    cell: (station) => (
      <Badge
        miw="max-content"
        variant={station.drifting ? "filled" : "light"}
        color={station.drifting ? "grape" : "gray"}
        tt="none"
      >
        {describeState(station)}
      </Badge>
    ),
  },
  {
    key: "before",
    onWide: true,
    head: t("statistics:figures.before"),
    right: true,
    value: ({ before_deg }) => before_deg,
    cell: ({ before_deg }) => formatError(before_deg),
  },
  {
    key: "recent",
    head: t("statistics:figures.recent"),
    right: true,
    value: ({ rmse_deg }) => rmse_deg,
    cell: ({ rmse_deg }) => formatError(rmse_deg),
  },
  {
    key: "change",
    head: t("statistics:figures.driftChange"),
    right: true,
    value: shownChange,
    cell: describeChange,
  },
  {
    key: "playbacks",
    onWide: true,
    head: t("statistics:figures.recentPlaybacks"),
    right: true,
    value: ({ playbacks }) => playbacks,
    cell: ({ playbacks }) => playbacks,
  },
];

function describeState(station: Station): string {
  if (station.drifting) return t("statistics:figures.drifting");
  return station.change_deg ? t("statistics:figures.steady") : t("statistics:figures.unknown");
}

/** Return the difference of the two means as the table shows them. */
function shownChange({ before_deg, rmse_deg, change_deg }: Station): number | null {
  if (!change_deg || before_deg === null || rmse_deg === null) return null;
  return changeAsShown(before_deg, rmse_deg, ERROR_DIGITS);
}

function describeChange(station: Station): string {
  if (!station.change_deg) return "–";
  const { low, high } = station.change_deg;
  const range = t("common:format.range", { from: formatError(low), to: formatError(high) });
  return `${formatError(shownChange(station))} (${range})`;
}
