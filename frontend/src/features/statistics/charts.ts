import type { Schemas } from "../../lib/api/client";
import { addDays } from "../../lib/days";
import { t } from "../../lib/i18n";
import { describeStop } from "../sessions/describeStop";
import { causesOf, countOf } from "./causes";
import type { FiguresSearch, Measure } from "./figuresSearch";
import { HOURS_DIGITS } from "./hours";

type Figure = Schemas["Figure"];
type Table = Schemas["ProgressTable"];

/** Colours of the service's figures. They have dark counterparts, and none is an alarm colour. */
const COLOURS = ["#1f3a93", "#d67500", "#2f7d4f", "#7b3fa0", "#7f5539", "#64748b"];
/** Patterns, dashes and markers, by which series differ without colours. */
const PATTERNS = ["", "/", ".", "x", "-", "|"];
const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];
export const GRID = {
  gridcolor: "#e2e8f0",
  zerolinecolor: "#cbd5e1",
  linecolor: "#94a3b8",
  automargin: true,
};
const ROW_PX = 44;
const MARGIN = { l: 56, r: 16, t: 16, b: 40 };

export const column = (name: string, kind: "text" | "number" = "number", digits = 0) => ({
  name,
  kind,
  digits,
});
const names = (rows: { station: string }[]) => [...new Set(rows.map((row) => row.station))].sort();
/** Return a trace for each station. */
const byStation = <Row extends { station: string }>(
  rows: Row[],
  trace: (own: Row[], place: number) => object,
) =>
  names(rows).map((station, place) => ({
    name: station,
    ...trace(
      rows.filter((row) => row.station === station),
      place,
    ),
  }));
const barMarker = (place: number) => ({
  color: nth(COLOURS, place),
  // The pattern is drawn over the colour. Plotly would otherwise draw the pattern instead of the colour.
  pattern: { shape: nth(PATTERNS, place), fillmode: "overlay", fgcolor: "white", solidity: 0.2 },
});
const nth = <Value>(values: readonly Value[], place: number) => values[place % values.length] as Value;

function layout(height: number, more: object): Figure["layout"] {
  return {
    height,
    margin: MARGIN,
    font: { family: "system-ui, sans-serif", size: 13 },
    hovermode: "closest",
    plot_bgcolor: "white",
    paper_bgcolor: "white",
    // Plotly would reverse the order of stacked bars.
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "normal" },
    ...more,
  };
}

/** Return the look of the line of one of several series. */
export const lineLook = (place: number) => ({
  line: { color: nth(COLOURS, place), dash: nth(DASHES, place) },
  marker: { color: nth(COLOURS, place), symbol: nth(MARKERS, place), size: 7 },
});

export const figure = (data: object[], height: number, more: object): Figure =>
  ({ data, layout: layout(height, more), texts: [] }) as unknown as Figure;

/** Return stacked bars of the stations by day or week. */
export function usageFigure(rows: Schemas["StationUse"][], search: FiguresSearch): Figure {
  const amount = search.of ?? "sessions";
  const traces = byStation(rows, (own, place) => ({
    type: "bar",
    x: own.map((row) => row.begins_on),
    y: own.map((row) => row[amount]),
    marker: barMarker(place),
    hovertemplate: `%{x}: %{y:${amount === "hours" ? `.${HOURS_DIGITS}f` : "d"}} ${t(`statistics:figures.${amount}`)}`,
  }));
  return figure(traces, 360, {
    barmode: "stack",
    xaxis: { ...GRID, type: "date" },
    yaxis: { ...GRID, title: { text: t(`statistics:figures.${amount}`) }, rangemode: "tozero" },
  });
}

export function usageTable(rows: Schemas["StationUse"][]): Table {
  return {
    columns: [
      column(t("statistics:figures.beginsOn"), "text"),
      column(t("statistics:figures.station"), "text"),
      column(t("statistics:figures.sessions")),
      column(t("statistics:figures.playbacks")),
      column(t("statistics:figures.stopped")),
      column(t("statistics:figures.hours"), "number", HOURS_DIGITS),
      column(t("statistics:figures.repetitions")),
    ],
    rows: rows.map((row) => [
      row.begins_on,
      row.station,
      row.sessions,
      row.playbacks,
      row.stopped,
      row.hours,
      row.repetitions,
    ]),
    texts: [],
  };
}

/** Return the weeks of one station with a week without a value in each gap. Plotly breaks the line there. */
const withGaps = (rows: Schemas["StationTracking"][]) =>
  rows.flatMap(({ begins_on, rmse_deg }, place) => {
    const expected = place > 0 ? addDays(rows[place - 1]?.begins_on ?? begins_on, 7) : begins_on;
    const week = { begins_on, rmse_deg };
    return begins_on > expected ? [{ begins_on: expected, rmse_deg: null }, week] : [week];
  });

/** Return a line for each station by week. */
export function trackingFigure(rows: Schemas["StationTracking"][]): Figure {
  const traces = byStation(rows, (own, place) => {
    const weeks = withGaps(own);
    return {
      type: "scatter",
      mode: "lines+markers",
      x: weeks.map(({ begins_on }) => begins_on),
      y: weeks.map(({ rmse_deg }) => rmse_deg),
      ...lineLook(place),
      hovertemplate: "%{x}: %{y:.2f}°",
    };
  });
  return figure(traces, 360, {
    xaxis: { ...GRID, type: "date" },
    yaxis: { ...GRID, title: { text: t("statistics:figures.rmse") }, rangemode: "tozero" },
  });
}

export function trackingTable(rows: Schemas["StationTracking"][]): Table {
  return {
    columns: [
      column(t("statistics:figures.beginsOn"), "text"),
      column(t("statistics:figures.station"), "text"),
      column(t("statistics:figures.playbacks")),
      column(t("statistics:figures.rmse"), "number", 2),
      column(t("statistics:figures.peak"), "number", 2),
    ],
    rows: rows.map((row) => [row.begins_on, row.station, row.playbacks, row.rmse_deg, row.peak_deg]),
    texts: [],
  };
}

/**
 * Return horizontal bars of the causes over all shown stations, with stopped sessions and alarms beside each
 * other.
 */
export function stopsFigure(rows: Schemas["StopCount"][]): Figure {
  const causes = causesOf(rows);
  const traces = (["sessions", "alarms"] as const).map((counted, place) => ({
    type: "bar",
    orientation: "h",
    name: t(`statistics:figures.counted.${counted}`),
    x: causes.map((code) => countOf(rows, code, counted)),
    y: causes.map(describeStop),
    marker: barMarker(place),
    hovertemplate: "%{y}: %{x}",
  }));
  return figure(traces, 130 + ROW_PX * causes.length, {
    barmode: "group",
    xaxis: { ...GRID, title: { text: t("statistics:figures.number") }, rangemode: "tozero" },
    yaxis: { ...GRID, autorange: "reversed" },
  });
}

export function stopsTable(rows: Schemas["StopCount"][]): Table {
  return {
    columns: [
      column(t("statistics:figures.cause"), "text"),
      column(t("statistics:figures.station"), "text"),
      column(t("statistics:figures.counted.sessions")),
      column(t("statistics:figures.counted.alarms")),
    ],
    rows: rows.map((row) => [describeStop(row.code), row.station || "–", row.sessions, row.alarms]),
    texts: [],
  };
}

const STAGES: Partial<Record<string, string>> = t("episodes:stages", { returnObjects: true });

/** Return a group of shoulders in words. */
export function describeGroup({ by, name }: Schemas["OutcomeGroup"]): string {
  if (by === "all") return t("statistics:figures.everyone");
  if (by === "stage")
    return name === ""
      ? t("statistics:figures.noStage")
      : t("statistics:figures.byStage", { name: STAGES[name] ?? name });
  return name === "" ? t("statistics:figures.noProgramme") : t("statistics:figures.byProgramme", { name });
}

/** Return the groups that have a value of a measure, with its change. */
export const shownGroups = (groups: Schemas["OutcomeGroup"][], measure: Measure) =>
  groups.flatMap((group) => {
    const change = group.changes.find((candidate) => candidate.measure === measure);
    return change ? [{ name: describeGroup(group), change }] : [];
  });

type Shown = ReturnType<typeof shownGroups>[number];

/**
 * Return a point with its confidence interval for each group. `axis`: name and unit of a change; the axis of a
 * share has its own name.
 */
export function outcomeFigure(shown: Shown[], part: "change" | "important", axis = ""): Figure {
  const factor = part === "important" ? 100 : 1;
  const own = shown.flatMap(({ name, change }) => {
    const estimate = change[part];
    return estimate ? [{ name, estimate, shoulders: change.shoulders }] : [];
  });
  const trace = {
    type: "scatter",
    mode: "markers",
    showlegend: false,
    x: own.map(({ estimate }) => factor * estimate.value),
    y: own.map(({ name, shoulders }) => t("statistics:figures.groupSize", { name, count: shoulders })),
    error_x: {
      type: "data",
      symmetric: false,
      array: own.map(({ estimate }) => factor * (estimate.high - estimate.value)),
      arrayminus: own.map(({ estimate }) => factor * (estimate.value - estimate.low)),
      color: COLOURS[0],
    },
    marker: { color: COLOURS[0], size: 10 },
    hovertemplate:
      part === "important" ? t("statistics:figures.percent", { value: "%{x:.1f}" }) : `${axis}: %{x:.1f}`,
  };
  return figure([trace], 90 + ROW_PX * own.length, {
    // Plotly leaves out a label that exceeds the margin, as half of "100 %" would.
    margin: { ...MARGIN, r: 28 },
    xaxis: {
      ...GRID,
      title: { text: axis },
      // The axis of a change contains zero, which is no change.
      ...(part === "important"
        ? { range: [0, 100], ticksuffix: t("statistics:figures.percent", { value: "" }) }
        : { rangemode: "tozero" }),
    },
    // Half a row is free above the first point and below the last one.
    yaxis: { ...GRID, range: [own.length - 0.5, -0.5], type: "category" },
  });
}

const percent = (estimate: Schemas["Estimate"] | null) => (estimate ? 100 * estimate.value : null);

/** Return a table of all measures of all shown groups. */
export function outcomeTable(groups: Schemas["OutcomeGroup"][]): Table {
  const figures = t("statistics:figures", { returnObjects: true });
  const digits = 1;
  return {
    columns: [
      column(figures.measure, "text"),
      column(figures.group, "text"),
      column(figures.patients),
      column(figures.shoulders),
      ...[figures.first, figures.last, figures.change, figures.changeLow, figures.changeHigh].map((name) =>
        column(name, "number", digits),
      ),
      column(figures.important),
      column(figures.detectable),
      ...[figures.weeks, figures.weeksLow, figures.weeksHigh].map((name) => column(name, "number", digits)),
    ],
    rows: groups.flatMap((group) =>
      group.changes.map(
        ({
          measure,
          patients,
          shoulders,
          first,
          last,
          change,
          important,
          detectable,
          weeks_to_important: weeks,
        }) => [
          t(`statistics:measures.${measure}`),
          describeGroup(group),
          patients,
          shoulders,
          first,
          last,
          change?.value ?? null,
          change?.low ?? null,
          change?.high ?? null,
          percent(important),
          percent(detectable),
          weeks?.[1] ?? null,
          weeks?.[0] ?? null,
          weeks?.[2] ?? null,
        ],
      ),
    ),
    texts: [],
  };
}
