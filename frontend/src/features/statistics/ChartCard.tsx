import { Button, Card, Stack, Text, Title } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { saveFile, toCsv } from "../../lib/csv";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { NumbersTable } from "../progress/NumbersTable";

/** A chart with its summary in words, its numbers, and a button that saves it as a file. */
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
        {figure && <Plot figure={figure} label={t("clinic:figures.figure", { title, summary })} />}
        <NumbersTable
          title={title}
          table={table}
          actions={
            <Button
              variant="default"
              leftSection={<IconDownload size={20} />}
              onClick={() => saveFile(`${name}.csv`, toCsv(table))}
            >
              {t("clinic:figures.csv")}
            </Button>
          }
        />
      </Stack>
    </Card>
  );
}
