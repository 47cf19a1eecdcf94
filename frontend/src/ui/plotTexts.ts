import type { Schemas } from "../lib/api/client";

type Figure = Schemas["Figure"];

/** Font size of a figure that states none. */
const FONT_PX = 12;
/** Widths of characters in the service's font size, in CSS pixels, rounded up. Japanese characters are wide. */
const [NARROW_PX, WIDE_PX] = [7.5, 13];
/** What a legend needs beside a name: the margins of the figure and the sample of the line. */
const BESIDE_NAME_PX = 120;
/** Below this width few numbers fit below a figure. */
const SMALL_PX = 480;
const FEW_TICKS = 4;
/** Share of the width that the names of bars may take. */
const NAMES = 0.4;
const MOST_LINES = 2;

const isWide = (character: string) => character >= "\u2e80";
const widthOf = (text: string) =>
  [...text].reduce((sum, character) => sum + (isWide(character) ? WIDE_PX : NARROW_PX), 0);

/** Return the lines of a text. No line is wider than `room` if the words allow that. */
function linesOf(text: string, room: number): string[] {
  // Japanese text breaks after any character, but never before a punctuation mark or a closing bracket.
  const parts = text.match(/[\u2e80-\uffff][、。，．）」・〜ー]*|[^\s\u2e80-\uffff]+\s*|\s+/gu) ?? [];
  const lines = [""];
  for (const part of parts) {
    const line = lines.at(-1) ?? "";
    if (line && widthOf((line + part).trimEnd()) > room) lines.push(part);
    else lines[lines.length - 1] = line + part;
  }
  return lines.map((line) => line.trimEnd());
}

/** Return the text with line breaks. Without `most` the whole text remains. */
export function wrapped(text: string, room: number, most = Number.POSITIVE_INFINITY): string {
  const lines = linesOf(text, room);
  const shown = lines.slice(0, most);
  return shown.join("<br>") + (lines.length > shown.length ? "…" : "");
}

/** Return a figure whose texts fit into `width`. Plotly cuts or overlaps texts that are too wide. */
export function fitTexts(figure: Figure, width: number): Figure {
  // Without layout, as in a hidden place, the width is not known.
  if (width === 0) return figure;
  const layout = { ...figure.layout, ...(width < SMALL_PX && fewerTicks(figure.layout)) };
  return { ...figure, data: figure.data.map((trace) => fitNames(trace, width)), layout };
}

/** A telephone's figure keeps its size, because larger texts would leave no room for the curves. */
const WIDE_SCREEN_PX = 1024;

/** Return the size of the page's texts, 1 for the browser's usual size. */
export function textScale(): number {
  const root_px = Number.parseFloat(getComputedStyle(document.documentElement).fontSize);
  return window.innerWidth < WIDE_SCREEN_PX || !root_px ? 1 : root_px / 16;
}

/** Return the figure with texts, height and margins of another size, so that its texts grow with the page's. */
export function enlarged(figure: Figure, scale: number): Figure {
  if (scale === 1) return figure;
  const { font, height, margin, ...layout } = figure.layout as {
    font?: { size?: number };
    height?: number;
    margin?: Record<string, number>;
  };
  const sides = Object.entries(margin ?? {}).map(([side, px]) => [side, px * scale]);
  return {
    ...figure,
    layout: {
      ...layout,
      font: { ...font, size: (font?.size ?? FONT_PX) * scale },
      ...(height && { height: height * scale }),
      ...(margin && { margin: Object.fromEntries(sides) }),
    },
  };
}

/** Return the trace with line breaks in its name, and in the names of its bars or points. */
function fitNames(trace: Figure["data"][number], width: number): Figure["data"][number] {
  const { name, y } = trace as { name?: unknown; y?: unknown[] };
  const labels = Array.isArray(y) && typeof y[0] === "string" ? (y as string[]) : null;
  const fit = (label: string) =>
    label
      .split("<br>")
      .map((line) => wrapped(line, NAMES * width, MOST_LINES))
      .join("<br>");
  return {
    ...trace,
    ...(typeof name === "string" && { name: wrapped(name, width - BESIDE_NAME_PX) }),
    ...(labels && { y: labels.map(fit) }),
  };
}

const fewerTicks = (layout: Figure["layout"]) =>
  Object.fromEntries(
    Object.entries(layout)
      .filter(([name]) => /^xaxis\d*$/.test(name))
      .map(([name, axis]) => [name, { nticks: FEW_TICKS, ...(axis as object) }]),
  );
