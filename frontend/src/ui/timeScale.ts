/** A scale from times to pixels, with the first and the last time. */
export type TimeScale = ((at: string | number) => number) & { ends: string[] };

/** Return the scale that spreads the times from `from_px` to `to_px`. A single time is at the right end. */
export function timeScale(moments: string[], from_px: number, to_px: number): TimeScale {
  const sorted = [...moments].sort((a, b) => Date.parse(a) - Date.parse(b));
  const first = sorted[0] ?? "1970-01-01T00:00:00Z";
  const last = sorted.at(-1) ?? first;
  const [start, end] = [Date.parse(first), Date.parse(last)];
  const scale = (at: string | number) => {
    const moment = typeof at === "number" ? at : Date.parse(at);
    return end > start ? from_px + ((moment - start) / (end - start)) * (to_px - from_px) : to_px;
  };
  return Object.assign(scale, { ends: end > start ? [first, last] : sorted.slice(0, 1) });
}
