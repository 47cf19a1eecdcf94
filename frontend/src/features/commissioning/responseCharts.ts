import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { figure, GRID, lineLook } from "../statistics/charts";

export type Response = Schemas["MotorStepResponse"];

/**
 * Return a chart with the responses of all motors with one load, and with the step. Runs with other gains
 * follow each other.
 */
export function responseFigure(responses: Response[]): Schemas["Figure"] {
  const end = Math.max(...responses.map((response) => response.times_s.at(-1) ?? 0));
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
  const traces = responses.map((response) => ({
    type: "scatter",
    mode: "lines",
    name: t("commissioning:drift.motor", { motor: response.motor }),
    x: response.times_s,
    y: response.angles_deg,
    line: lineLook(response.motor - 1).line,
    hovertemplate: "%{x:.2f} s: %{y:.2f}°",
  }));
  return figure([goal, ...traces], 300, {
    xaxis: { ...GRID, title: { text: t("commissioning:responses.time") } },
    yaxis: { ...GRID, title: { text: t("commissioning:responses.angle") } },
  });
}

/** Return the names of the loads of these responses, in the order of measurement. */
export const loadsOf = (responses: Response[]) => [...new Set(responses.map((response) => response.load))];
