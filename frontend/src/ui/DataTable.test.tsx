import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import type { ComponentProps } from "react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import * as csv from "../lib/csv";
import { DataTable } from "./DataTable";
import { type Column, shownTable, sortedRows } from "./tableRows";

type Row = { name: string; stops: number | null };
const ROWS: Row[] = [
  { name: "Ito", stops: 2 },
  { name: "Abe", stops: null },
  { name: "Sato", stops: 10 },
];
const COLUMNS: Column<Row>[] = [
  { key: "name", head: "Name", always: true, value: ({ name }) => name, cell: ({ name }) => name },
  {
    key: "stops",
    head: "Stops",
    right: true,
    total: true,
    value: ({ stops }) => stops,
    cell: ({ stops }) => stops ?? "–",
    onWide: true,
  },
  { key: "open", head: "Open", always: true, cell: ({ name }) => <button type="button">Open {name}</button> },
];
const names = () =>
  screen
    .getAllByRole("row")
    .slice(1, 4)
    .map((row) => row.firstChild?.textContent);

/** A table that shows a part of its rows and can fetch all. */
const ofAll = (props: Pick<ComponentProps<typeof DataTable<Row>>, "rows" | "rowName" | "fetchAll">) => (
  <MantineProvider env="test">
    <QueryClientProvider client={new QueryClient()}>
      <DataTable name="stops" label="Stops" columns={COLUMNS} rowKey={({ name }) => name} more {...props} />
    </QueryClientProvider>
  </MantineProvider>
);

beforeEach(() => {
  localStorage.clear();
  render(
    <MantineProvider env="test">
      <DataTable name="stops" label="Stops" columns={COLUMNS} rows={ROWS} rowKey={({ name }) => name} more />
    </MantineProvider>,
  );
});
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

it("sorts by a column's order where its value has another", () => {
  const patients = [
    { name: "山田", kana: "ヤマダ" },
    { name: "阿部", kana: "アベ" },
  ];
  const name: Column<(typeof patients)[0]> = {
    key: "name",
    head: "Name",
    value: (row) => row.name,
    order: (row) => row.kana,
    cell: (row) => row.name,
  };
  const sorted = sortedRows(patients, [name], { key: "name", direction: "ascending" });
  expect(sorted.map((row) => row.name)).toEqual(["阿部", "山田"]);
  expect(shownTable(sorted, [name]).rows).toEqual([["阿部"], ["山田"]]);
});

it("sorts upwards, downwards and as it was, without a value last", () => {
  const head = screen.getByRole("button", { name: "Stops" });
  fireEvent.click(head);
  expect(names()).toEqual(["Ito", "Sato", "Abe"]);
  expect(screen.getByRole("columnheader", { name: "Stops" }).getAttribute("aria-sort")).toBe("ascending");
  fireEvent.click(head);
  expect(names()).toEqual(["Sato", "Ito", "Abe"]);
  fireEvent.click(head);
  expect(names()).toEqual(["Ito", "Abe", "Sato"]);
});

it("ends the head of a column of numbers where the numbers end", () => {
  expect(screen.getByRole("button", { name: "Stops" }).dataset.right).toBe("true");
  expect(screen.getByRole("button", { name: "Name" }).dataset.right).toBeUndefined();
});

it("adds up the rows shown, and says that there are more", () => {
  expect(screen.getByRole("row", { name: "Total 12" })).toBeTruthy();
  expect(screen.getByText(/^3 rows are shown; there are more/)).toBeTruthy();
});

it("shows a dash for a sum that would mislead, and says why", () => {
  cleanup();
  const noTotal = "Sessions have no total.";
  const sessions: Column<Row> = { key: "sessions", head: "Sessions", right: true, noTotal, cell: () => 1 };
  const table = (columns: Column<Row>[]) => (
    <MantineProvider env="test">
      <DataTable name="stops" label="Stops" columns={columns} rows={ROWS} rowKey={({ name }) => name} />
    </MantineProvider>
  );
  const { rerender } = render(table([...COLUMNS, sessions]));
  expect(screen.getByRole("row", { name: "Total 12 –" })).toBeTruthy();
  expect(screen.getByText(noTotal)).toBeTruthy();
  rerender(table(COLUMNS));
  expect(screen.queryByText(noTotal)).toBeNull();
});

it("saves the columns and the order that are shown, and remembers hidden columns", () => {
  const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
  fireEvent.click(screen.getByRole("button", { name: "Name" }));
  fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
  expect(saved).toHaveBeenLastCalledWith("stops.csv", "\ufeffName,Stops\r\nAbe,\r\nIto,2\r\nSato,10\r\n");
  fireEvent.click(screen.getByRole("button", { name: "Columns" }));
  fireEvent.click(screen.getByRole("checkbox", { name: "Stops" }));
  fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
  expect(saved).toHaveBeenLastCalledWith("stops.csv", "\ufeffName\r\nAbe\r\nIto\r\nSato\r\n");
  expect(localStorage.getItem("kata.columns.stops")).toContain("stops");
  // The column that identifies a row cannot be hidden.
  expect(screen.queryByRole("checkbox", { name: "Name" })).toBeNull();
});

describe("on a telephone", () => {
  const heads = () => screen.getAllByRole("columnheader").map((head) => head.textContent);
  const table = ofAll({ rows: ROWS });

  beforeEach(() => {
    cleanup();
    localStorage.clear();
    const { matchMedia } = window;
    vi.spyOn(window, "matchMedia").mockImplementation((query) => ({
      ...matchMedia(query),
      matches: query === "(max-width: 47.99em)",
    }));
  });

  it("hides the columns of a wide screen until the user chooses", () => {
    const { unmount } = render(table);
    expect(heads()).toEqual(["Name", "Open"]);
    fireEvent.click(screen.getByRole("button", { name: "Columns" }));
    fireEvent.click(screen.getByRole("checkbox", { name: "Stops" }));
    expect(heads()).toEqual(["Name", "Stops", "Open"]);
    unmount();
    render(table);
    expect(heads()).toEqual(["Name", "Stops", "Open"]);
  });

  it("has its own choice", () => {
    localStorage.setItem("kata.columns.stops", "[]");
    render(table);
    expect(heads()).toEqual(["Name", "Open"]);
  });
});

it("does not sort by a column of buttons, and leaves it out of the file", () => {
  expect(screen.getByRole("columnheader", { name: "Open" }).getAttribute("aria-sort")).toBeNull();
  expect(screen.queryByRole("button", { name: "Open" })).toBeNull();
  const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
  fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
  expect(saved).toHaveBeenLastCalledWith("stops.csv", expect.not.stringContaining("Open"));
});

it("has boxes only if its rows have names", () => {
  expect(screen.queryByRole("checkbox", { name: "Select all rows" })).toBeNull();
});

it("saves only the selected rows, in the order shown", () => {
  cleanup();
  const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
  const fetchAll = vi.fn();
  const table = (rows: Row[]) => ofAll({ rows, rowName: ({ name }) => name, fetchAll });
  const { rerender } = render(table(ROWS));
  const all = () => screen.getByRole<HTMLInputElement>("checkbox", { name: "Select all rows" });
  fireEvent.click(screen.getByRole("checkbox", { name: "Select Sato" }));
  fireEvent.click(screen.getByRole("checkbox", { name: "Select Ito" }));
  expect(all().indeterminate).toBe(true);
  expect(screen.getByRole("status").textContent).toBe("2\u00a0of\u00a03 rows selected");
  // Sorted by name: the order of the file is that of the table.
  fireEvent.click(screen.getByRole("button", { name: "Name" }));
  fireEvent.click(screen.getByRole("button", { name: "Save 2 selected as CSV" }));
  expect(saved).toHaveBeenLastCalledWith("stops.csv", "\ufeffName,Stops\r\nIto,2\r\nSato,10\r\n");
  // A row that a filter has removed is neither counted nor saved.
  rerender(table(ROWS.slice(0, 2)));
  fireEvent.click(screen.getByRole("button", { name: "Save 1 selected as CSV" }));
  expect(saved).toHaveBeenLastCalledWith("stops.csv", "\ufeffName,Stops\r\nIto,2\r\n");
  fireEvent.click(all());
  expect(screen.getByRole("button", { name: "Save 2 selected as CSV" })).toBeTruthy();
  expect(all().checked).toBe(true);
  fireEvent.click(screen.getByRole("button", { name: "Select none" }));
  expect(screen.getByRole("button", { name: "Save as CSV" })).toBeTruthy();
  expect(fetchAll).not.toHaveBeenCalled();
});

it("saves the rows of all pages in the order shown, and says when there are too many", async () => {
  cleanup();
  const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
  const fetchAll = vi.fn(async () => ({ rows: [...ROWS, { name: "Kato", stops: 3 }], complete: false }));
  render(ofAll({ rows: ROWS, fetchAll }));
  expect(screen.getByText(/The CSV file has all rows/)).toBeTruthy();
  fireEvent.click(screen.getByRole("button", { name: "Name" }));
  fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
  await screen.findByText("The file has only the first 4 rows. Narrow the list for the others.");
  expect(saved.mock.calls).toEqual([
    ["stops.csv", "\ufeffName,Stops\r\nAbe,\r\nIto,2\r\nKato,3\r\nSato,10\r\n"],
  ]);
});

it("shows a column below another one on a telephone, until the user chooses it there", async () => {
  cleanup();
  vi.stubGlobal("matchMedia", (query: string) => ({
    matches: query.includes("max-width"),
    addEventListener: () => undefined,
    removeEventListener: () => undefined,
  }));
  const columns: Column<Row>[] = [
    { key: "name", head: "Name", always: true, value: ({ name }) => name, cell: ({ name }) => name },
    {
      key: "stops",
      head: "Stops",
      below: "name",
      value: ({ stops }) => stops,
      cell: ({ stops }) => `Stops: ${stops}`,
    },
  ];
  render(
    <MantineProvider env="test">
      <DataTable name="moved" label="Moved" columns={columns} rows={ROWS} rowKey={({ name }) => name} />
    </MantineProvider>,
  );
  expect(screen.getAllByRole("columnheader").map((head) => head.textContent)).toEqual(["Name"]);
  // A row without a value says nothing below.
  expect(names()).toEqual(["ItoStops: 2", "Abe", "SatoStops: 10"]);
  fireEvent.click(screen.getByRole("button", { name: "Columns" }));
  fireEvent.click(await screen.findByRole("checkbox", { name: "Stops" }));
  expect(names()).toEqual(["Ito", "Abe", "Sato"]);
  expect(screen.getAllByRole("columnheader")).toHaveLength(2);
  vi.unstubAllGlobals();
});
