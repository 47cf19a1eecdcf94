import { Button } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import type { Schemas } from "../lib/api/client";
import { saveFile, toCsv } from "../lib/csv";
import { t } from "../lib/i18n";

/** The button that saves rows as a file. `selected`: the number of selected rows, if only these are saved. */
export function CsvButton(props: { onSave: () => void; loading?: boolean; selected?: number }) {
  const { onSave, loading = false, selected = 0 } = props;
  return (
    <Button variant="default" leftSection={<IconDownload size={20} />} loading={loading} onClick={onSave}>
      {selected > 0 ? t("ui:table.csvOfSelected", { count: selected }) : t("ui:table.csv")}
    </Button>
  );
}

/** Saves a chart's numbers as a file. `name`: the file's name without its ending. */
export function SaveTableButton({ name, table }: { name: string; table: Schemas["ProgressTable"] }) {
  return <CsvButton onSave={() => saveFile(`${name}.csv`, toCsv(table))} />;
}
