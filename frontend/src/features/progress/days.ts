import type { Schemas } from "../../lib/api/client";
import { formatDayOf } from "../../lib/format";

/** Return the figure with its times as local days, because the page formats every day. */
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
