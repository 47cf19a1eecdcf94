import { Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useCallback, useState } from "react";
import { api, type Chart } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translatePlaced } from "../../lib/serverText";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { withLocalDays } from "./days";
import { NumbersTable } from "./NumbersTable";

/** Minimum width for two columns of panels, in CSS pixels. In a narrower place their titles would overlap. */
const TWO_COLUMNS_PX = 572;

/** One chart of an episode's progress with its numbers. */
export function ProgressChart({ chart, episodeId }: { chart: Chart; episodeId: string }) {
  const title = t(`progress:charts.${chart}.title`);
  const shows = t(`progress:charts.${chart}.shows`);
  const nothing = t(`progress:charts.${chart}.nothing`);
  const [columns, setColumns] = useState<1 | 2 | null>(null);
  // Not measured again, because paper has another width.
  const measure = useCallback((element: HTMLElement | null) => {
    if (element) setColumns((before) => before ?? (element.clientWidth < TWO_COLUMNS_PX ? 1 : 2));
  }, []);
  const progress = useQuery({
    queryKey: ["progress", episodeId, chart, columns],
    queryFn: () => api.progress(episodeId, chart, columns ?? 1),
    enabled: columns !== null,
    // The space of this chart is reserved.
    meta: { late: true },
    select: ({ figure, table, notes, simulated }) => ({
      figure: withLocalDays(figure),
      table,
      notes: translatePlaced(notes).lines,
      simulated,
    }),
  });
  const chartData = progress.data;
  return (
    <Stack gap="xs" component="section" aria-label={title} ref={measure}>
      <Title order={2} size="h3">
        {title}
      </Title>
      <ProblemNote error={progress.error} />
      {progress.isPending && <Skeleton h={340} />}
      {chartData && chartData.table.rows.length === 0 && <Text>{nothing}</Text>}
      {chartData && chartData.table.rows.length > 0 && (
        <>
          <Text size="sm">{shows}</Text>
          <SimulatedBadge simulated={chartData.simulated} />
          <Plot figure={chartData.figure} label={t("progress:progress.figure", { title, shows })} />
          {chartData.notes.map(({ title: name, sentence, source }) => (
            <Text key={name + sentence} size="sm">
              <Text span inherit fw={600} translate="no">
                {name}
              </Text>{" "}
              {sentence}{" "}
              <Text span inherit c="dimmed" translate="no">
                {source}
              </Text>
            </Text>
          ))}
          <NumbersTable name={chart} title={title} table={chartData.table} />
        </>
      )}
    </Stack>
  );
}
