import { Button } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import type { Schemas } from "../lib/api/client";
import { saveFile, toCsv } from "../lib/csv";
import { t } from "../lib/i18n";

/** The button that saves rows as a file. */
export function CsvButton({ onSave, loading = false }: { onSave: () => void; loading?: boolean }) {
  return (
    <Button variant="default" leftSection={<IconDownload size={20} />} loading={loading} onClick={onSave}>
      {t("ui:table.csv")}
    </Button>
  );
}

/** Saves a chart's numbers as a file. `name`: the file's name without its ending. */
export function SaveTableButton({ name, table }: { name: string; table: Schemas["ProgressTable"] }) {
  return <CsvButton onSave={() => saveFile(`${name}.csv`, toCsv(table))} />;
}
