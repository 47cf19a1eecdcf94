/** A part of a figure in seconds of its time axis. */
export type PlotWindow = { start_s: number; end_s: number };

/**
 * Return the window of a Plotly change: null for the whole figure, undefined if the time axis did not change.
 */
export function toWindow(change: Record<string, unknown>): PlotWindow | null | undefined {
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
