import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { toLocalDateTime } from "../../lib/days";
import { formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { column, figure, GRID, lineLook } from "../statistics/charts";

export type Entry = Schemas["Commissioning"];
/** The figures that show drift, in the order of their charts, with their number of digits. */
export const DRIFT = {
  friction_deg: 3,
  play_deg: 2,
  lag_s: 4,
  temperature_c: 0,
  voltage_v: 1,
  damaged_answers_percent: 1,
} as const;
export type DriftName = keyof typeof DRIFT;
const MOTORS = [1, 2, 3, 4, 5] as const;

const figureOf = (record: Entry, motor: number, name: DriftName) =>
  record.figures.find((condition) => condition.motor === motor)?.[name] ?? null;

/** Return the records that measured this figure, oldest first. */
export const measured = (records: Entry[], name: DriftName) =>
  records
    .filter((record) => MOTORS.some((motor) => figureOf(record, motor, name) !== null))
    .sort((one, other) => one.ended_at.localeCompare(other.ended_at));

/** Return a chart with a line for each motor over the times of the records. */
export function driftFigure(records: Entry[], name: DriftName): Schemas["Figure"] {
  const traces = MOTORS.map((motor, place) => ({
    type: "scatter",
    mode: "lines+markers",
    name: t("commissioning:drift.motor", { motor }),
    // Plotly shows a time without a zone as it is.
    x: records.map((record) => toLocalDateTime(new Date(record.ended_at))),
    y: records.map((record) => figureOf(record, motor, name)),
    ...lineLook(place),
    hovertemplate: `%{x|%Y-%m-%d}, ${t(`commissioning:drift.${name}`)}: %{y:.${DRIFT[name]}f}`,
  }));
  return figure(traces, 300, {
    xaxis: { ...GRID, type: "date" },
    yaxis: { ...GRID, title: { text: t(`commissioning:drift.${name}`) } },
  });
}

/** Return a table with a row for each record. */
export const driftTable = (records: Entry[], name: DriftName): Schemas["ProgressTable"] => ({
  columns: [
    column(t("commissioning:drift.date"), "text"),
    ...MOTORS.map((motor) => column(t("commissioning:drift.motor", { motor }), "number", DRIFT[name])),
  ],
  rows: records.map((record) => [
    formatDayOf(record.ended_at),
    ...MOTORS.map((motor) => figureOf(record, motor, name)),
  ]),
  texts: [],
});
