import type { Schemas } from "../../lib/api/client";
import { formatDayOf } from "../../lib/format";

/** Convert the figure's moments to local days, which only the browser knows. */
export function withLocalDays(figure: Schemas["Figure"]): Schemas["Figure"] {
  const data = figure.data.map((trace) =>
    Array.isArray(trace.customdata)
      ? {
          ...trace,
          customdata: trace.customdata.map((at) => (typeof at === "string" ? formatDayOf(at) : at)),
        }
      : trace,
  );
  return { ...figure, data };
}
