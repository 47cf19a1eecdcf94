import type { Schemas } from "./api/client";
import { withoutJoiners } from "./joinUnits";

/** Return one cell. An apostrophe is put before a text that a spreadsheet would run as a formula. */
function cell(value: string | number | null): string {
  if (value === null) return "";
  const text =
    typeof value === "number" ? String(value) : withoutJoiners(value).replace(/^[=+\-@\t\r]/, "'$&");
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Return a table as CSV (RFC 4180). The byte order mark makes spreadsheets read it as UTF-8. */
export function toCsv(table: Schemas["ProgressTable"]): string {
  const lines = [table.columns.map((column) => column.name), ...table.rows];
  return `\ufeff${lines.map((line) => line.map(cell).join(",")).join("\r\n")}\r\n`;
}

/** Make the browser save a text as a file. */
export function saveFile(name: string, text: string, type = "text/csv"): void {
  const address = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  URL.revokeObjectURL(address);
}
