import type { Schemas } from "../../lib/api/client";
import { formatDayOf } from "../../lib/format";

/** The service knows moments; which day one was, and how it is written, the browser does. */
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
