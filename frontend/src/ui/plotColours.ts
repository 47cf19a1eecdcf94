import type { Schemas } from "../lib/api/client";

/** Replacement colours for the dark scheme. The service draws for paper and the light scheme. */
export const DARK_COLOURS: Record<string, string> = {
  "#1f3a93": "#9db2ff",
  "#e07b00": "#ff9a3c",
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
 * Return a copy of the figure in the scheme's colours. Plotly modifies its input, so even the light figure is
 * copied.
 */
export function recolour(figure: Schemas["Figure"], scheme: "light" | "dark"): Schemas["Figure"] {
  if (scheme === "light") return structuredClone(figure);
  const recoloured = JSON.stringify(figure).replace(/"(#[0-9a-fA-F]{6}|white)"/g, (match, colour: string) =>
    `"${DARK_COLOURS[colour.toLowerCase()] ?? ""}"`.replace('""', match),
  );
  const { data, layout, texts } = JSON.parse(recoloured) as Schemas["Figure"];
  const font = { ...(layout.font as object | undefined), color: "#e6e8eb" };
  return { data, layout: { ...layout, font, paper_bgcolor: "#242424", plot_bgcolor: "#242424" }, texts };
}
