import { Button, Group, Skeleton, Text, useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../lib/api/client";
import { LANGUAGE } from "../lib/language";
import { translatePlaced } from "../lib/serverText";
import { FIGURE, PLOTLY, PLOTLY_DAYS } from "./figureMessages";
import { inScheme } from "./plotColours";
import { type PlotWindow, windowOf } from "./plotWindow";

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
  const [failed, setFailed] = useState(false);
  const [tries, setTries] = useState(0);
  const heard = useRef(onWindow);
  heard.current = onWindow;
  const ending = useRef(() => {});
  const scheme = useComputedColorScheme();
  // biome-ignore lint/correctness/useExhaustiveDependencies: another try draws again
  useEffect(() => {
    const element = place.current;
    if (!element) return;
    let gone = false;
    const draw = async () => {
      const { default: Plotly } = await import("plotly.js-cartesian-dist-min");
      if (gone) return;
      if (LANGUAGE === "ja") {
        Plotly.register({ moduleType: "locale", name: LANGUAGE, dictionary: PLOTLY, format: PLOTLY_DAYS });
      }
      // Plotly writes into the layout it is given what is done to it.
      const { data, layout } = inScheme(translatePlaced(figure), scheme);
      const plot = await Plotly.react(element, data, layout, config);
      plot.removeAllListeners("plotly_relayout");
      plot.on("plotly_relayout", (change) => {
        const window = windowOf(change);
        if (window !== undefined) heard.current?.(window);
      });
      ending.current = () => Plotly.purge(element);
      setFailed(false);
      setDrawn(true);
    };
    draw().catch(() => {
      if (!gone) setFailed(true);
    });
    return () => {
      gone = true;
    };
  }, [figure, scheme, tries]);
  useEffect(() => () => ending.current(), []);
  const height = typeof figure.layout.height === "number" ? figure.layout.height : 340;
  return (
    <div style={{ position: "relative", minHeight: height }}>
      {failed && (
        <Group role="alert">
          <Text>{FIGURE.failed}</Text>
          <Button variant="default" onClick={() => setTries(tries + 1)}>
            {FIGURE.again}
          </Button>
        </Group>
      )}
      {!drawn && !failed && <Skeleton pos="absolute" inset={0} aria-label={FIGURE.drawing} />}
      <figure ref={place} aria-label={label} data-drawn={drawn} style={{ margin: 0 }} />
    </div>
  );
}
