import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { TRACES } from "../../app/theme";
import { isAlive, store } from "../../lib/live/store";

const SECONDS = 15;
const HEIGHT = 22;

/**
 * A chart of an axis's last seconds. It reads the store directly, so that ten updates per second do not cause
 * React to render.
 */
export function AxisSparkline({ axis, min, max }: { axis: number; min: number; max: number }) {
  const place = useRef<HTMLDivElement>(null);
  const colours = TRACES[useComputedColorScheme()];
  useEffect(() => {
    const element = place.current;
    if (!element) return;
    const times: number[] = [];
    const setpoints: (number | null)[] = [];
    const measured: (number | null)[] = [];
    const plot = new uPlot(
      {
        width: element.clientWidth,
        height: HEIGHT,
        legend: { show: false },
        cursor: { show: false },
        // A line at the end of the range keeps a distance from the numbers below it.
        padding: [2, 0, 5, 0],
        scales: { x: { time: false }, y: { range: [min, max] } },
        axes: [{ show: false }, { show: false }],
        series: [
          {},
          { stroke: colours.setpoint, width: 1.5, points: { show: false } },
          { stroke: colours.measured, width: 2, points: { show: false } },
        ],
      },
      [times, setpoints, measured],
      element,
    );
    const fit = new ResizeObserver(() => plot.setSize({ width: element.clientWidth, height: HEIGHT }));
    fit.observe(element);
    let last: unknown = null;
    const leave = store.subscribe(() => {
      const state = store.get();
      const axes = state.live?.axes;
      if (axes === last) return;
      last = axes;
      const now = performance.now() / 1000;
      // Missing data leaves a gap in the line.
      const shown = isAlive(state) ? axes?.[axis] : undefined;
      times.push(now);
      setpoints.push(shown?.setpoint_deg ?? null);
      measured.push(shown?.measured_deg ?? null);
      while (times[0] !== undefined && times[0] < now - SECONDS) {
        times.shift();
        setpoints.shift();
        measured.shift();
      }
      plot.setData([times, setpoints, measured], false);
      plot.setScale("x", { min: now - SECONDS, max: now });
    });
    return () => {
      leave();
      fit.disconnect();
      plot.destroy();
    };
  }, [axis, min, max, colours]);
  return <div ref={place} aria-hidden />;
}
