import { clinicFormat } from "./days";
import { withoutJoiners } from "./joinUnits";
import { LOCALE } from "./language";

/** A typed text as a day such as 2026-11-21, or why it is none. */
type ReadDay = { day: string } | { problem: "unreadable" | "noSuchDay" };

/** Japanese eras: the year before their first one, and their last year. */
const ERAS: [names: string[], before: number, last: number][] = [
  [["明治", "m"], 1867, 45],
  [["大正", "t"], 1911, 15],
  [["昭和", "s"], 1925, 64],
  [["平成", "h"], 1988, 31],
  [["令和", "r"], 2018, 99],
];

const YEAR_FIRST = /^(\d{4})\s*[-/.年]\s*(\d{1,2})\s*[-/.月]\s*(\d{1,2})\s*日?$/;
const DIGITS = /^(\d{4})(\d{2})(\d{2})$/;
const ERA =
  /^(明治|大正|昭和|平成|令和|[mtshr])\s*\.?\s*(\d{1,2}|元)\s*[-/.年]\s*(\d{1,2})\s*[-/.月]\s*(\d{1,2})\s*日?$/;
const YEAR_LAST = /^(\d{1,2})[-/.](\d{1,2})[-/.](\d{4})$/;
const DAY_MONTH = /^(\d{1,2})\.?\s+([a-z]{3,9})\.?,?\s+(\d{4})$/;
const MONTH_DAY = /^([a-z]{3,9})\.?\s+(\d{1,2}),?\s+(\d{4})$/;

const monthName = clinicFormat("en", { month: "long" });
const MONTHS = Array.from({ length: 12 }, (_, month) => monthName(Date.UTC(2026, month, 15)).toLowerCase());
/** True if the locale writes 11/21/2026 and not 21/11/2026. */
const MONTH_FIRST = clinicFormat(LOCALE, {})(Date.UTC(2026, 10, 21, 12)).startsWith("11");

/**
 * Read a day as people write it: 2026-11-21, 2026/11/21, 20261121, 21 Nov 2026, Nov 21, 2026, 2026年11月21日, 令和8年11月21日,
 * S43.4.12. A date of three numbers that ends with the year has the order of the locale.
 */
export function readDay(typed: string): ReadDay {
  const numbers = parts(withoutJoiners(typed).normalize("NFKC").trim().toLowerCase());
  if (!numbers) return { problem: "unreadable" };
  const [year, month, day] = numbers;
  const iso = [
    String(year).padStart(4, "0"),
    ...[month, day].map((part) => String(part).padStart(2, "0")),
  ].join("-");
  const exists = new Date(`${iso}T00:00Z`).getTime();
  return !Number.isNaN(exists) && new Date(exists).toISOString().startsWith(iso)
    ? { day: iso }
    : { problem: "noSuchDay" };
}

/** Return year, month and day as numbers, or null if the text has no known form. */
function parts(text: string): [number, number, number] | null {
  const [, ...found] = YEAR_FIRST.exec(text) ?? DIGITS.exec(text) ?? [];
  if (found.length === 3) return found.map(Number) as [number, number, number];
  return ofEra(text) ?? ofNames(text) ?? ofLocale(text);
}

function ofEra(text: string): [number, number, number] | null {
  const [, name = "", year = "", month, day] = ERA.exec(text) ?? [];
  const [, before = 0, last = 0] = ERAS.find(([names]) => names.includes(name)) ?? [];
  const ofEra = year === "元" ? 1 : Number(year);
  return ofEra >= 1 && ofEra <= last ? [before + ofEra, Number(month), Number(day)] : null;
}

function ofNames(text: string): [number, number, number] | null {
  const [, firstDay, firstName, firstYear] = DAY_MONTH.exec(text) ?? [];
  const [, name = firstName, day = firstDay, year = firstYear] = MONTH_DAY.exec(text) ?? [];
  const month = name === undefined ? -1 : MONTHS.findIndex((known) => known.startsWith(name));
  return month < 0 ? null : [Number(year), month + 1, Number(day)];
}

function ofLocale(text: string): [number, number, number] | null {
  const [, first, second, year] = YEAR_LAST.exec(text) ?? [];
  if (year === undefined) return null;
  const [month, day] = MONTH_FIRST ? [first, second] : [second, first];
  return [Number(year), Number(month), Number(day)];
}
