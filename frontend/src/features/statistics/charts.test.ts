import { expect, it } from "vitest";
import { outcomeFigure, trackingFigure } from "./charts";

const share = { value: 0.77, low: 0.61, high: 0.88 };

it("writes the percent of an axis as the texts beside it", () => {
  const shown = [{ name: "All", change: { shoulders: 35, important: share } }];
  const { data, layout } = outcomeFigure(shown as Parameters<typeof outcomeFigure>[0], "important");
  expect(layout.xaxis).toMatchObject({ ticksuffix: " %", range: [0, 100] });
  expect(data[0]).toMatchObject({
    hovertemplate: "%{x:.1f} %",
    x: [77],
    y: ["All<br>35 shoulders"],
  });
});

it("breaks a station's line in weeks without playbacks", () => {
  const week = (station: string, begins_on: string, rmse_deg: number) => ({
    station,
    begins_on,
    rmse_deg,
    playbacks: 3,
    peak_deg: 2,
  });
  const { data } = trackingFigure([
    week("Station 1", "2026-03-23", 0.6),
    week("Station 2", "2026-03-23", 0.9),
    week("Station 1", "2026-03-30", 0.7),
    week("Station 1", "2026-04-20", 0.8),
  ]);
  expect(data[0]).toMatchObject({
    x: ["2026-03-23", "2026-03-30", "2026-04-06", "2026-04-20"],
    y: [0.6, 0.7, null, 0.8],
    mode: "lines+markers",
  });
  expect(data[1]).toMatchObject({ x: ["2026-03-23"], y: [0.9] });
});
