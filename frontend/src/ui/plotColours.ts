import type { Schemas } from "../lib/api/client";

/** Replacement colours for the dark scheme. The service draws for paper and the light scheme. */
export const DARK_COLOURS: Record<string, string> = {
  "#1f3a93": "#9db2ff",
  "#d67500": "#ff9a3c",
  "#5e9c76": "#7fc79a",
  "#2f7d4f": "#7fc79a",
  "#7b3fa0": "#cf9df0",
  "#7f5539": "#d3a583",
  "#64748b": "#a9b6c9",
  "#e2e8f0": "#3d4148",
  "#cbd5e1": "#5c626b",
  "#94a3b8": "#7d8590",
  white: "#242424",
  // Colours of the service's Plotly template.
  "#ebf0f8": "#3d4148",
  "#c8d4e3": "#5c626b",
  "#dfe8f3": "#3d4148",
  "#2a3f5f": "#e6e8eb",
};

/**
 * Maximum width of a figure on paper in CSS pixels: an upright sheet of A4 or Letter without its margins and
 * the card's padding.
 */
const PAPER_PX = 640;

/** Return a copy of the figure for paper. It has the light colours and fits on the sheet. */
export function toPaper(figure: Schemas["Figure"], width: number): Schemas["Figure"] {
  const light = recolour(figure, "light");
  return { ...light, layout: { ...light.layout, width: Math.min(width, PAPER_PX) } };
}

/** Copy the shown range of each axis, which the user may have changed, from one layout to another. */
export function keepZoom(from: Record<string, unknown>, to: Record<string, unknown>): void {
  for (const [name, axis] of Object.entries(from)) {
    if (!/^[xy]axis\d*$/.test(name)) continue;
    const { range, autorange } = axis as { range?: unknown[]; autorange?: unknown };
    to[name] = { ...(to[name] as object | undefined), autorange, ...(range && { range: [...range] }) };
  }
}

/**
 * Return a copy of the figure in the scheme's colours. Plotly modifies its input, so even the light figure is
 * copied. `background`: the colour behind a dark figure.
 */
export function recolour(
  figure: Schemas["Figure"],
  scheme: "light" | "dark",
  background = "#242424",
): Schemas["Figure"] {
  if (scheme === "light") return structuredClone(figure);
  const recoloured = JSON.stringify(figure).replace(/"(#[0-9a-fA-F]{6}|white)"/g, (match, colour: string) =>
    `"${DARK_COLOURS[colour.toLowerCase()] ?? ""}"`.replace('""', match),
  );
  const { data, layout, texts } = JSON.parse(recoloured) as Schemas["Figure"];
  const font = { ...(layout.font as object | undefined), color: "#e6e8eb" };
  return { data, layout: { ...layout, font, paper_bgcolor: background, plot_bgcolor: background }, texts };
}
