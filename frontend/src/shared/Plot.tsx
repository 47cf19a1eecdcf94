import { Skeleton, useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../api/client";
import { FIGURE, PLOTLY, PLOTLY_DAYS } from "./figureWords";
import { LANGUAGE } from "./language";
import { inScheme } from "./plotColours";
import { spoken } from "./plotWords";
import { type PlotWindow, windowOf } from "./window";

// A double click shows all of it again, whatever part was last asked for.
const config = {
  responsive: true,
  locale: LANGUAGE,
  displaylogo: false,
  doubleClick: "autosize",
  modeBarButtonsToRemove: ["resetScale2d"],
};

/**
 * A Plotly figure as the service built it. Plotly is large, and comes only when a figure is looked at.
 *
 * Of a long motion the service draws what a screen can show; onWindow hears which part somebody looks at closer, to ask for that.
 */
export function Plot({
  figure,
  label,
  onWindow,
}: {
  figure: Schemas["Figure"];
  label: string;
  onWindow?: (window: PlotWindow | null) => void;
}) {
  const place = useRef<HTMLElement>(null);
  const [drawn, setDrawn] = useState(false);
  const heard = useRef(onWindow);
  heard.current = onWindow;
  const ending = useRef(() => {});
  const scheme = useComputedColorScheme();
  useEffect(() => {
    const element = place.current;
    if (!element) return;
    let gone = false;
    void import("plotly.js-cartesian-dist-min").then(async ({ default: Plotly }) => {
      if (gone) return;
      if (LANGUAGE === "ja") {
        Plotly.register({ moduleType: "locale", name: LANGUAGE, dictionary: PLOTLY, format: PLOTLY_DAYS });
      }
      // Plotly writes into the layout it is given what is done to it.
      const { data, layout } = inScheme(spoken(figure), scheme);
      const plot = await Plotly.react(element, data, layout, config);
      plot.removeAllListeners("plotly_relayout");
      plot.on("plotly_relayout", (change) => {
        const window = windowOf(change);
        if (window !== undefined) heard.current?.(window);
      });
      ending.current = () => Plotly.purge(element);
      setDrawn(true);
    });
    return () => {
      gone = true;
    };
  }, [figure, scheme]);
  useEffect(() => () => ending.current(), []);
  const height = typeof figure.layout.height === "number" ? figure.layout.height : 340;
  return (
    <div style={{ position: "relative", minHeight: height }}>
      {!drawn && <Skeleton pos="absolute" inset={0} aria-label={FIGURE.drawing} />}
      <figure ref={place} aria-label={label} data-drawn={drawn} style={{ margin: 0 }} />
    </div>
  );
}
