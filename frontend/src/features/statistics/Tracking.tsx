import { Badge, Skeleton, Stack, Table, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDeg, formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { ChartCard } from "./ChartCard";
import { spanWords, trackingFigure, trackingTable } from "./charts";
import { daysOf, type FiguresSearch, spanOf } from "./figuresSearch";

/** Shows the tracking error of the stations by week, and whether it increases. */
export function Tracking({ search }: { search: FiguresSearch }) {
  const span = spanOf(search, new Date());
  const tracking = useQuery({ queryKey: ["tracking", span], queryFn: () => api.trackingQuality(span) });
  const rows = tracking.data?.rows ?? [];
  const drift = tracking.data?.drift ?? [];
  const worst = drift.filter((station) => station.drifting).map((station) => station.station);
  return (
    <Stack>
      <ProblemNote error={tracking.error} />
      {tracking.isPending && <Skeleton h={620} />}
      {tracking.data && rows.length === 0 && <Text>{t("clinic:figures.nothing")}</Text>}
      {rows.length > 0 && (
        <>
          <Drift drift={drift} />
          <ChartCard
            name="tracking"
            title={t("clinic:subjects.tracking.title")}
            summary={t("clinic:figures.trackingSummary", {
              days: spanWords(daysOf(search, new Date())),
              drift:
                worst.length > 0
                  ? t("clinic:tiles.trackingDrift", { stations: formatList(worst) })
                  : t("clinic:tiles.trackingSteady"),
            })}
            figure={trackingFigure(rows)}
            table={trackingTable(rows)}
          />
        </>
      )}
    </Stack>
  );
}

function Drift({ drift }: { drift: Schemas["StationDrift"][] }) {
  return (
    <Table.ScrollContainer minWidth={640}>
      <Table verticalSpacing="xs" aria-label={t("clinic:tiles.trackingDetail")} data-testid="drift">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("clinic:figures.station")}</Table.Th>
            <Table.Th>{t("clinic:figures.drift")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.before")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.recent")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.driftChange")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.playbacks")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {drift.map((station) => (
            <Table.Tr key={station.station}>
              <Table.Td>{station.station}</Table.Td>
              <Table.Td>
                <Badge
                  miw="max-content"
                  variant={station.drifting ? "filled" : "light"}
                  color={station.drifting ? "grape" : "gray"}
                  tt="none"
                >
                  {stateWords(station)}
                </Badge>
              </Table.Td>
              <Table.Td ta="right">{formatDeg(station.before_deg, 2)}</Table.Td>
              <Table.Td ta="right">{formatDeg(station.rmse_deg, 2)}</Table.Td>
              <Table.Td ta="right">{changeWords(station.change_deg)}</Table.Td>
              <Table.Td ta="right">{station.playbacks}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}

function stateWords(station: Schemas["StationDrift"]): string {
  if (station.drifting) return t("clinic:figures.drifting");
  return station.change_deg ? t("clinic:figures.steady") : t("clinic:figures.unknown");
}

function changeWords(change: Schemas["Estimate"] | null): string {
  if (!change) return "–";
  const range = t("common:format.range", { from: formatDeg(change.low, 2), to: formatDeg(change.high, 2) });
  return `${formatDeg(change.value, 2)} (${range})`;
}
