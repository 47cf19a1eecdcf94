import { Card, Stack, Text, Title } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { NumbersTable } from "../progress/NumbersTable";

/** A chart with its summary in words and its numbers. `name`: of the file with the numbers. */
export function ChartCard(props: {
  name: string;
  title: string;
  summary: string;
  figure: Schemas["Figure"] | null;
  table: Schemas["ProgressTable"];
}) {
  const { name, title, summary, figure, table } = props;
  return (
    <Card withBorder component="section" aria-label={title}>
      <Stack gap="sm">
        <Title order={2} size="h4">
          {title}
        </Title>
        <Text size="sm">{summary}</Text>
        {figure && <Plot figure={figure} label={t("statistics:figures.figure", { title, summary })} />}
        <NumbersTable name={name} title={title} table={table} />
      </Stack>
    </Card>
  );
}
