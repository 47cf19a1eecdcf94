import { Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";

const REFRESH_MS = 10_000;
const WIDTH = 120;
const HEIGHT = 20;
/**
 * Smallest temperature range of the chart in degrees Celsius, so that noise of one degree does not look like a
 * rise.
 */
const LEAST_SPAN_C = 10;

type Point = Schemas["DriveTrendPoint"];

/** Return the path of a motor's temperatures in the chart. An unknown temperature makes a gap. */
export function trendPath(points: Point[], motor: number): string {
  const known = points.flatMap(({ temperature_c }) => temperature_c[motor - 1] ?? []);
  if (known.length === 0) return "";
  const low = Math.min(...known);
  const span = Math.max(Math.max(...known) - low, LEAST_SPAN_C);
  const begin = new Date(points[0]?.at ?? 0).getTime();
  const length = new Date(points.at(-1)?.at ?? 0).getTime() - begin || 1;
  let drawing = false;
  return points
    .flatMap(({ at, temperature_c }) => {
      const value = temperature_c[motor - 1] ?? null;
      const command = drawing ? "L" : "M";
      drawing = value !== null;
      if (value === null) return [];
      const x = ((new Date(at).getTime() - begin) / length) * WIDTH;
      const y = HEIGHT - 1 - ((value - low) / span) * (HEIGHT - 2);
      return [`${command}${x.toFixed(1)} ${y.toFixed(1)}`];
    })
    .join("");
}

/**
 * Shows supply voltage and temperature of each drive, with the temperatures of the last hours. Renders nothing
 * if no drive reports them.
 */
export function DriveHealth() {
  const alive = useAlive();
  const axes = useLive("axes");
  const trend = useQuery({ queryKey: ["driveTrend"], queryFn: api.driveTrend, refetchInterval: REFRESH_MS });
  const points = trend.data?.points ?? [];
  const reports = axes?.some(({ voltage_v, temperature_c }) => voltage_v !== null || temperature_c !== null);
  if (!alive || !axes || !reports) return null;
  return (
    <section aria-label={t("station:drives.title")} data-testid="drives">
      <Title order={2} size="h6">
        {t("station:drives.title")}
      </Title>
      <Table fz="xs" withRowBorders={false} verticalSpacing={2} horizontalSpacing={6}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("station:drives.motor")}</Table.Th>
            <Table.Th>{t("station:drives.supply")}</Table.Th>
            <Table.Th>{t("station:drives.temperature")}</Table.Th>
            <Table.Th>{t("station:drives.course")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {axes.map(({ motor, voltage_v, temperature_c }) => (
            <Table.Tr key={motor}>
              <Table.Td>{motor}</Table.Td>
              <Table.Td>{figure(voltage_v, 1, "V")}</Table.Td>
              <Table.Td>{figure(temperature_c, 0, "°C")}</Table.Td>
              <Table.Td>
                <Course points={points} motor={motor} />
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </section>
  );
}

function figure(value: number | null | undefined, digits: number, unit: string): string {
  return value === null || value === undefined ? "–" : `${value.toFixed(digits)} ${unit}`;
}

/** Shows one motor's temperatures over time, and the lowest and highest in words. */
function Course({ points, motor }: { points: Point[]; motor: number }) {
  const known = points.flatMap(({ temperature_c }) => temperature_c[motor - 1] ?? []);
  if (known.length < 2) return <Text size="xs">{figure(null, 0, "")}</Text>;
  const words = t("station:drives.range", {
    low: Math.min(...known).toFixed(0),
    high: Math.max(...known).toFixed(0),
  });
  return (
    <svg width={WIDTH} height={HEIGHT} role="img" aria-label={words}>
      <title>{words}</title>
      <path d={trendPath(points, motor)} fill="none" stroke="currentColor" strokeWidth={1.5} />
    </svg>
  );
}
