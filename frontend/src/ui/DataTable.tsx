import { Button, Checkbox, Group, Popover, Stack, Table, Text, UnstyledButton } from "@mantine/core";
import { IconArrowDown, IconArrowUp, IconColumns } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { saveFile, toCsv } from "../lib/csv";
import { t } from "../lib/i18n";
import { joinUnits } from "../lib/joinUnits";
import type { SavedRows } from "../lib/usePagedQuery";
import { CsvButton } from "./CsvButton";
import { ProblemNote } from "./ProblemNote";
import { ScrolledTable } from "./ScrolledTable";
import { SelectAll, type Selection, SelectRow, useSelection } from "./selection";
import { type Column, type Sorting, shownTable, sortedRows, turned } from "./tableRows";
import classes from "./ui.module.css";
import { useHiddenColumns } from "./useHiddenColumns";

/** The smallest width of a column. Four columns fit beside each other on a telephone. */
const COLUMN_PX = 72;
/** The width of a table on an upright tablet. A table with more columns scrolls sideways on a telephone only. */
const TABLET_PX = 736;

interface DataTableProps<Row> {
  /** Name of the file and of the stored choice of columns. */
  name: string;
  label: string;
  columns: Column<Row>[];
  rows: Row[];
  rowKey: (row: Row) => string;
  /** True if the list has rows that are not loaded. */
  more?: boolean;
  /** Fetches all rows for the file. Without it the file contains only the loaded rows. */
  fetchAll?: () => Promise<SavedRows<Row>>;
  isDimmed?: (row: Row) => boolean;
  /** Name of a row. With it, the user can select rows and save only these. */
  rowName?: (row: Row) => string;
  /** True for a table with many rows, whose rows have nothing to press. */
  dense?: boolean;
}

/**
 * A table whose columns can be sorted and chosen. It has totals, and the shown or the selected rows can be saved as
 * CSV.
 */
export function DataTable<Row>(props: DataTableProps<Row>) {
  const { name, label, columns, rowKey, rowName, more = false, fetchAll, isDimmed, dense = false } = props;
  const [sorting, setSorting] = useState<Sorting>(null);
  const { hidden, setHidden, movedBelow } = useHiddenColumns(name, columns);
  const shown = columns.filter(({ key, always }) => always || !hidden.includes(key));
  const rows = sortedRows(props.rows, columns, sorting);
  const selection = useSelection(rows.map(rowKey));
  const save = (saved: Row[]) => saveFile(`${name}.csv`, toCsv(shownTable(saved, shown)));
  const selectable = rowName !== undefined;
  return (
    <Stack gap="xs">
      <Group justify="space-between">
        <RowCount
          count={rows.length}
          more={more}
          canFetchAll={fetchAll !== undefined}
          selection={selection}
        />
        <Group gap="xs">
          <ColumnChoice columns={columns} hidden={hidden} onChange={setHidden} />
          {fetchAll && more && selection.count === 0 ? (
            <CsvOfAll fetchAll={fetchAll} onSave={(all) => save(sortedRows(all, columns, sorting))} />
          ) : (
            <CsvButton
              selected={selection.count}
              onSave={() =>
                save(selection.count > 0 ? rows.filter((row) => selection.has(rowKey(row))) : rows)
              }
            />
          )}
        </Group>
      </Group>
      <ScrolledTable minWidth={Math.min(TABLET_PX, COLUMN_PX * shown.length)}>
        <Table
          className={classes.rows ?? ""}
          verticalSpacing={dense ? 6 : "md"}
          highlightOnHover
          aria-label={label}
        >
          <Table.Thead>
            <Table.Tr>
              {selectable && <SelectAll selection={selection} />}
              {shown.map((column) => (
                <Head
                  key={column.key}
                  column={column}
                  sorting={sorting}
                  onSort={() => setSorting(turned(sorting, column.key))}
                />
              ))}
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {rows.map((row) => (
              <Table.Tr key={rowKey(row)} {...(isDimmed?.(row) && { c: "dimmed" })}>
                {rowName && <SelectRow id={rowKey(row)} name={rowName(row)} selection={selection} />}
                {shown.map((column) => (
                  <Table.Td key={column.key} {...numbers(column)}>
                    {joined(column.cell(row))}
                    {movedBelow(column).map((moved) => (
                      <Below key={moved.key} column={moved} row={row} />
                    ))}
                  </Table.Td>
                ))}
              </Table.Tr>
            ))}
          </Table.Tbody>
          <Totals columns={shown} rows={rows} selectable={selectable} />
        </Table>
      </ScrolledTable>
      <MissingTotals columns={shown} rows={rows} />
    </Stack>
  );
}

/** Return what a cell shows. A text of a record, such as the name of a station, comes without joiners. */
const joined = (shown: ReactNode) => (typeof shown === "string" ? joinUnits(shown) : shown);

/** What a hidden column says, below the cell of another one. */
function Below<Row>({ column, row }: { column: Column<Row>; row: Row }) {
  if (column.value?.(row) === null) return null;
  return (
    <Text size="sm" component="div">
      {joined(column.cell(row))}
    </Text>
  );
}

/** Says how many rows are shown or selected. */
function RowCount(props: { count: number; more: boolean; canFetchAll: boolean; selection: Selection }) {
  const { count, more, canFetchAll, selection } = props;
  if (selection.count > 0) {
    return (
      <Group gap="xs">
        <Text size="sm" role="status">
          {t("ui:table.selected", { selected: selection.count, count })}
        </Text>
        <Button variant="subtle" size="compact-md" onClick={() => selection.selectAll(false)}>
          {t("ui:table.selectNone")}
        </Button>
      </Group>
    );
  }
  const words = more ? (canFetchAll ? "ui:table.rowsOfAll" : "ui:table.rowsOfMore") : "ui:table.rows";
  return <Text size="sm">{t(words, { count })}</Text>;
}

/** Saves the rows of all pages, also of those that are not loaded. */
function CsvOfAll<Row>(props: { fetchAll: () => Promise<SavedRows<Row>>; onSave: (rows: Row[]) => void }) {
  const fetched = useMutation({ mutationFn: props.fetchAll, onSuccess: ({ rows }) => props.onSave(rows) });
  return (
    <>
      <CsvButton loading={fetched.isPending} onSave={() => fetched.mutate()} />
      {fetched.data?.complete === false && (
        <Text size="sm" role="status">
          {t("ui:table.incomplete", { count: fetched.data.rows.length })}
        </Text>
      )}
      <ProblemNote error={fetched.error} />
    </>
  );
}

/** Return the alignment of a cell. The style sheet separates a column of numbers from a text on its right. */
const numbers = ({ right }: { right?: boolean }) => right && { ta: "right" as const, "data-right": true };

/**
 * The head of a column. Pressing it sorts in ascending order, then in descending order, and then in the order
 * of the service.
 */
function Head<Row>(props: { column: Column<Row>; sorting: Sorting; onSort: () => void }) {
  const { column, sorting } = props;
  const direction = sorting?.key === column.key ? sorting.direction : null;
  const Icon = direction === "descending" ? IconArrowDown : IconArrowUp;
  if (!column.value) {
    return (
      <Table.Th {...numbers(column)}>
        <span className={classes.head} data-right={column.right}>
          {column.head}
        </span>
      </Table.Th>
    );
  }
  return (
    <Table.Th aria-sort={direction ?? "none"} {...numbers(column)}>
      <UnstyledButton
        className={classes.head ?? ""}
        data-right={column.right}
        data-sorted={direction !== null}
        onClick={props.onSort}
      >
        {column.head}
        <Icon size={16} aria-hidden style={{ visibility: direction ? "visible" : "hidden" }} />
      </UnstyledButton>
    </Table.Th>
  );
}

const hasTotals = <Row,>(columns: Column<Row>[], rows: Row[]) =>
  rows.length > 1 && columns.some(({ total }) => total);

/** Says why columns have no total. */
function MissingTotals<Row>({ columns, rows }: { columns: Column<Row>[]; rows: Row[] }) {
  if (!hasTotals(columns, rows)) return null;
  return columns.map(
    ({ key, noTotal }) =>
      noTotal && (
        <Text key={key} size="sm">
          {noTotal}
        </Text>
      ),
  );
}

/** Shows the sums over the shown rows, for the columns that have a sum. */
function Totals<Row>(props: { columns: Column<Row>[]; rows: Row[]; selectable: boolean }) {
  const { columns, rows, selectable } = props;
  if (!hasTotals(columns, rows)) return null;
  const cell = (column: Column<Row>, place: number): ReactNode => {
    if (typeof column.total === "function") return column.total(rows);
    if (column.total) return rows.reduce((sum, row) => sum + Number(column.value?.(row) ?? 0), 0);
    if (column.noTotal) return "–";
    return place === 0 ? t("ui:table.total") : null;
  };
  return (
    <Table.Tfoot>
      <Table.Tr>
        {selectable && <Table.Td className={classes.select ?? ""} />}
        {columns.map((column, place) => (
          <Table.Td key={column.key} fw={700} {...numbers(column)}>
            {cell(column, place)}
          </Table.Td>
        ))}
      </Table.Tr>
    </Table.Tfoot>
  );
}

/** Lets the user choose the shown columns. The browser stores the choice. */
function ColumnChoice<Row>(props: {
  columns: Column<Row>[];
  hidden: string[];
  onChange: (hidden: string[]) => void;
}) {
  const { columns, hidden } = props;
  const free = columns.filter(({ always }) => !always);
  return (
    <Popover position="bottom-end" withArrow trapFocus>
      <Popover.Target>
        <Button variant="default" leftSection={<IconColumns size={20} />}>
          {t("ui:table.columns")}
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <Checkbox.Group
          label={t("ui:table.columnsShown")}
          value={free.map(({ key }) => key).filter((key) => !hidden.includes(key))}
          onChange={(kept) => props.onChange(free.map(({ key }) => key).filter((key) => !kept.includes(key)))}
        >
          <Stack gap={4} mt="xs">
            {free.map(({ key, head }) => (
              <Checkbox key={key} value={key} label={head} size="md" />
            ))}
          </Stack>
        </Checkbox.Group>
      </Popover.Dropdown>
    </Popover>
  );
}
