import type { ReactNode } from "react";
import type { Schemas } from "../lib/api/client";
import { LANGUAGE } from "../lib/language";

/**
 * One column of a table. The CSV file contains `value`, and rows are sorted by it unless the column has an `order`; null:
 * the cell is empty. A column of buttons has no `value`.
 */
export interface Column<Row> {
  key: string;
  head: string;
  value?: (row: Row) => string | number | null;
  order?: (row: Row) => string;
  cell: (row: Row) => ReactNode;
  right?: boolean;
  /** True if the table shows the sum of the column, or what it shows for these rows instead. */
  total?: boolean | ((rows: Row[]) => string);
  /** The reason why the table shows no sum of this column of numbers. */
  noTotal?: string;
  /** True if the user cannot hide the column. */
  always?: boolean;
  /** True if a telephone hides the column until the user chooses it. */
  onWide?: boolean;
  /** Key of the column whose cells say on a telephone what this column says, until the user chooses it there. */
  below?: string;
}

/** How the rows are sorted. Null: in the order of the service. */
export type Sorting = { key: string; direction: "ascending" | "descending" } | null;

const collator = new Intl.Collator(LANGUAGE, { numeric: true });

/** Return the sorting after a press on a head: ascending, descending, none. */
export function turned(sorting: Sorting, key: string): Sorting {
  if (sorting?.key !== key) return { key, direction: "ascending" };
  return sorting.direction === "ascending" ? { key, direction: "descending" } : null;
}

/** Return the rows in order. Rows without a value come last in both directions. */
export function sortedRows<Row>(rows: Row[], columns: Column<Row>[], sorting: Sorting): Row[] {
  const column = columns.find(({ key }) => key === sorting?.key);
  const value = column?.order ?? column?.value;
  if (!value) return rows;
  const sign = sorting?.direction === "descending" ? -1 : 1;
  return [...rows].sort((one, other) => {
    const [left, right] = [value(one), value(other)];
    if (left === null || right === null) return Number(left === null) - Number(right === null);
    if (typeof left === "number" && typeof right === "number") return sign * (left - right);
    return sign * collator.compare(String(left), String(right));
  });
}

/** Return the shown content of a table, for a file. */
export function shownTable<Row>(rows: Row[], columns: Column<Row>[]): Schemas["ProgressTable"] {
  const filled = columns.flatMap(({ head, value }) => (value ? [{ head, value }] : []));
  return {
    columns: filled.map(({ head }) => ({ name: head, kind: "text", digits: 0 })),
    rows: rows.map((row) => filled.map(({ value }) => value(row))),
    texts: [],
  };
}
