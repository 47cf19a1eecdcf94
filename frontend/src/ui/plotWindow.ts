/** A part of a figure, in seconds of its own clock. */
export type PlotWindow = { start_s: number; end_s: number };

/** What a change of Plotly's says of its clock: a window, null for all of it, undefined where it is about something else. */
export function windowOf(change: Record<string, unknown>): PlotWindow | null | undefined {
  for (const [name, value] of Object.entries(change)) {
    const axis = /^(xaxis\d*)\.(range\[0\]|range|autorange)$/.exec(name);
    if (!axis) continue;
    if (axis[2] === "autorange") return null;
    const [start, end] = axis[2] === "range" ? (value as unknown[]) : [value, change[`${axis[1]}.range[1]`]];
    const start_s = Math.max(0, Number(start));
    const end_s = Number(end);
    return end_s > start_s ? { start_s, end_s } : null;
  }
  return undefined;
}
