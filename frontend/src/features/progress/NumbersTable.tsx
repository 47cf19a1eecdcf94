import { Button, Group, ScrollArea, Table } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconTable } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatDeg, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { joinUnits } from "../../lib/joinUnits";
import { translatePlaced } from "../../lib/serverText";
import { SaveTableButton } from "../../ui/CsvButton";
import { reachByKeyboard } from "../../ui/reachByKeyboard";

type Column = Schemas["ProgressColumn"];

/** Shows a chart's numbers as a table on request, and saves them as a file. `name`: the file's name without its ending. */
export function NumbersTable(props: { name: string; title: string; table: Schemas["ProgressTable"] }) {
  const { name, title } = props;
  const table = translatePlaced(props.table);
  const [shown, rows] = useDisclosure(false);
  return (
    <>
      <Group>
        <SaveTableButton name={name} table={table} />
        <Button
          variant="default"
          leftSection={<IconTable size={20} />}
          aria-expanded={shown}
          onClick={rows.toggle}
        >
          {shown ? t("progress:progress.hideNumbers") : t("progress:progress.showNumbers")}
        </Button>
      </Group>
      {shown && (
        <ScrollArea.Autosize mah={480} type="auto" viewportRef={reachByKeyboard}>
          <Table
            stickyHeader
            withTableBorder
            verticalSpacing="xs"
            aria-label={t("progress:progress.numbers", { title })}
          >
            <Table.Thead>
              <Table.Tr>
                {table.columns.map((column) => (
                  <Table.Th key={column.name} scope="col" ta={alignment(column)}>
                    {joinUnits(column.name)}
                  </Table.Th>
                ))}
              </Table.Tr>
            </Table.Thead>
            <Table.Tbody>
              {table.rows.map((row) => (
                <Table.Tr key={row.join(" ")}>
                  {table.columns.map((column, place) => (
                    <Table.Td key={column.name} ta={alignment(column)}>
                      {cellText(column, row[place] ?? null)}
                    </Table.Td>
                  ))}
                </Table.Tr>
              ))}
            </Table.Tbody>
          </Table>
        </ScrollArea.Autosize>
      )}
    </>
  );
}

const alignment = (column: Column) => (column.kind === "number" ? "right" : "left");

function cellText(column: Column, value: string | number | null): string {
  if (typeof value === "number") return formatDeg(value, column.digits);
  if (value === null) return "–";
  if (column.kind === "moment") return formatMoment(value);
  return value;
}
