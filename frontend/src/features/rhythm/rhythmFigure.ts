import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { column, figure, GRID } from "../statistics/charts";

export type Rhythm = Schemas["ApparatusRhythm"];
export type Curve = Schemas["RhythmCurve"];

/** Upper end of the apparatus's range of upward rotation, degrees. */
const LIMIT_DEG = 20;
const HEIGHT = 420;
/** Colours that have dark counterparts. None is an alarm colour. */
const COLOURS: Record<Curve["of"], string> = { taught: "#1f3a93", played: "#d67500", sound: "#2f7d4f" };
const WIDTHS: Record<Curve["of"], number> = { taught: 4, played: 2, sound: 2 };
const DASHES: Record<Curve["direction"], string> = { raising: "solid", lowering: "dot" };

/** Return the name of a curve: its origin, its direction, and its plane if the motion has several planes. */
export function curveName(curve: Curve, curves: Curve[]): string {
  const name = t(`rhythm:names.${curve.of}.${curve.direction}`);
  const like = curves.filter(({ of, direction }) => of === curve.of && direction === curve.direction);
  return like.length > 1 ? t("rhythm:nameInPlane", { name, plane: describePlane(curve) }) : name;
}

export const describePlane = (curve: Curve): string =>
  t("rhythm:planeOf", { plane: t(`rhythm:planes.${curve.plane}`), angle: formatDeg(curve.plane_deg, 0) });

/**
 * Return a figure of the scapula over the elevation of the arm, with a line for each curve and the apparatus's
 * limit.
 */
export function rhythmFigure({ curves }: Rhythm): Schemas["Figure"] {
  const lines = curves.map((curve) => ({
    type: "scatter",
    mode: "lines",
    name: curveName(curve, curves),
    x: curve.elevation_deg,
    y: curve.scapula_deg,
    line: { color: COLOURS[curve.of], dash: DASHES[curve.direction], width: WIDTHS[curve.of] },
    hovertemplate: "%{x:.0f}°: %{y:.1f}°",
  }));
  const all = curves.flatMap((curve) => curve.elevation_deg);
  const limit = {
    type: "scatter",
    mode: "lines",
    name: t("rhythm:limit"),
    x: [Math.min(...all), Math.max(...all)],
    y: [LIMIT_DEG, LIMIT_DEG],
    line: { color: "#64748b", dash: "dash", width: 2 },
    hoverinfo: "skip",
  };
  const nameOfLimit = {
    text: t("rhythm:limit"),
    x: 1,
    xref: "paper",
    xanchor: "right",
    y: LIMIT_DEG,
    yref: "y",
    yanchor: "bottom",
    showarrow: false,
  };
  // The played motion is drawn last, over the taught one.
  return figure([limit, ...lines.reverse()], HEIGHT, {
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "reversed" },
    annotations: [nameOfLimit],
    xaxis: { ...GRID, title: { text: t("rhythm:elevation") } },
    yaxis: { ...GRID, title: { text: t("rhythm:scapula") } },
  });
}

/** Return a table with a row for each degree of elevation. */
export function rhythmTable({ curves }: Rhythm): Schemas["ProgressTable"] {
  const values = curves.map(
    ({ elevation_deg, scapula_deg }) =>
      new Map(elevation_deg.map((at, place) => [Math.floor(at), scapula_deg[place] ?? null])),
  );
  const degrees = [...new Set(values.flatMap((of) => [...of.keys()]))].sort((one, other) => one - other);
  return {
    columns: [
      column(t("rhythm:elevation")),
      ...curves.map((curve) => column(t("rhythm:ofCurve", { name: curveName(curve, curves) }), "number", 1)),
    ],
    rows: degrees.map((at) => [at, ...values.map((of) => of.get(at) ?? null)]),
    texts: [],
  };
}
