import { MantineProvider } from "@mantine/core";
import { render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { TrendChart } from "./TrendChart";

afterEach(() => vi.restoreAllMocks());

it("draws a chart in the width of its place from the first rendering on", () => {
  vi.spyOn(Element.prototype, "clientWidth", "get").mockReturnValue(512);
  const points = [{ at: "2026-11-25T09:30:00Z", value: 4 }];
  render(
    <MantineProvider env="test">
      <TrendChart label="Pain" trends={[{ name: "Pain", points }]} max={10} step={5} />
    </MantineProvider>,
  );
  expect(screen.getByRole("img", { name: "Pain" }).getAttribute("width")).toBe("512");
});
