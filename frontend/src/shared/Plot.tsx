import { Skeleton } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../api/client";

const config = { responsive: true, displaylogo: false };

/** A Plotly figure as the service built it. Plotly is large, and comes only when a figure is looked at. */
export function Plot({ figure, label }: { figure: Schemas["Figure"]; label: string }) {
  const place = useRef<HTMLDivElement>(null);
  const [drawn, setDrawn] = useState(false);
  useEffect(() => {
    const element = place.current;
    if (!element) return;
    let gone = false;
    let purge = () => {};
    void import("plotly.js-cartesian-dist-min").then(async ({ default: Plotly }) => {
      if (gone) return;
      await Plotly.react(element, figure.data, figure.layout, config);
      purge = () => Plotly.purge(element);
      setDrawn(true);
    });
    return () => {
      gone = true;
      purge();
    };
  }, [figure]);
  const height = typeof figure.layout.height === "number" ? figure.layout.height : 340;
  return (
    <div style={{ position: "relative", minHeight: height }}>
      {!drawn && <Skeleton pos="absolute" inset={0} aria-label="The figure is being drawn" />}
      <div ref={place} role="img" aria-label={label} data-drawn={drawn} />
    </div>
  );
}
