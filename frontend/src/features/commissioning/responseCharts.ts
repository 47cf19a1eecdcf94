import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { column, figure, GRID, lineLook } from "../statistics/charts";

export type Response = Schemas["MotorStepResponse"];

/** Return a chart with the responses of all motors with one load, and with the step. */
export const responseFigure = (responses: Response[]) =>
  chart(
    responses,
    responses.map((response) =>
      trace(response, t("commissioning:drift.motor", { motor: response.motor }), response.motor - 1),
    ),
  );

/** Return the numbers of the chart of all motors with one load. */
export const responseTable = (responses: Response[]) =>
  tableOf(responses.map((response) => [t("commissioning:drift.motor", { motor: response.motor }), response]));

/** Return a table with a row for each time, and a column with the angles of each named response. */
function tableOf(named: [string, Response][]): Schemas["ProgressTable"] {
  const angles = named.map(
    ([, response]) => new Map(response.times_s.map((time, n) => [time, response.angles_deg[n] ?? null])),
  );
  const times = [...new Set(named.flatMap(([, response]) => response.times_s))].sort((a, b) => a - b);
  return {
    columns: [
      column(t("commissioning:responses.time"), "number", 2),
      ...named.map(([name]) => column(`${name}, ${t("commissioning:responses.angle")}`, "number", 2)),
    ],
    rows: times.map((time) => [time, ...angles.map((angle) => angle.get(time) ?? null)]),
    texts: [],
  };
}

/** Return the last response of each motor: the one with the present gains. */
export const newest = (responses: Response[]) =>
  responses.filter((one, n) => !responses.slice(n + 1).some((later) => later.motor === one.motor));

/** Return a chart for each motor whose gains were changed, with its former and its present response to one load. */
export function comparisons(responses: Response[]) {
  return newest(responses).flatMap((present) => {
    const former = responses.find((one) => one.motor === present.motor);
    if (!former || (["p_gain", "i_gain", "d_gain"] as const).every((gain) => former[gain] === present[gain]))
      return [];
    const names = [t("commissioning:tuning.former"), t("commissioning:tuning.present")] as const;
    const lines = [trace(former, names[0], 1), trace(present, names[1], 0)];
    const table = tableOf([
      [names[0], former],
      [names[1], present],
    ]);
    return [{ motor: present.motor, figure: chart([former, present], lines), table }];
  });
}

const trace = (response: Response, name: string, place: number) => ({
  type: "scatter",
  mode: "lines",
  name,
  x: response.times_s,
  y: response.angles_deg,
  line: lineLook(place).line,
  hovertemplate: "%{x:.2f} s: %{y:.2f}°",
});

function chart(responses: Response[], traces: object[]): Schemas["Figure"] {
  const end = Math.max(0, ...responses.map((response) => response.times_s.at(-1) ?? 0));
  const height = responses[0]?.step_deg ?? 0;
  const goal = {
    type: "scatter",
    mode: "lines",
    name: t("commissioning:responses.goal"),
    x: [0, end],
    y: [height, height],
    line: { color: "#64748b", width: 1 },
    hoverinfo: "skip",
  };
  return figure([goal, ...traces], 300, {
    xaxis: { ...GRID, title: { text: t("commissioning:responses.time") } },
    yaxis: { ...GRID, title: { text: t("commissioning:responses.angle") } },
  });
}

/** Return the names of the loads of these responses, in the order of measurement. */
export const loadsOf = (responses: Response[]) => [...new Set(responses.map((response) => response.load))];
