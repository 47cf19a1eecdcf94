import { expect, it } from "vitest";
import { outcomeFigure } from "./charts";

const share = { value: 0.77, low: 0.61, high: 0.88 };

it("writes the percent of an axis as the texts beside it", () => {
  const shown = [{ name: "All patients", change: { shoulders: 35, important: share } }];
  const { data, layout } = outcomeFigure(shown as Parameters<typeof outcomeFigure>[0], "important");
  expect(layout.xaxis).toMatchObject({ ticksuffix: " %", range: [0, 100] });
  expect(data[0]).toMatchObject({ hovertemplate: "%{x:.1f} %", x: [77] });
});
