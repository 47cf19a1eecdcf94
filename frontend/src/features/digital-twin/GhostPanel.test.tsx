import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { GhostPanel } from "./GhostPanel";
import { Ghost } from "./ghost";

afterEach(cleanup);

it("gives the slider a row of its own where it would be too short to use", () => {
  const angles_deg: [number, number, number, number, number][] = [
    [15, 109, 10, 0, 0],
    [15, 109, 50, 0, 0],
  ];
  render(
    <MantineProvider env="test">
      <GhostPanel ghost={new Ghost({ times_s: [0, 2], angles_deg })} violations={[]} />
    </MantineProvider>,
  );
  const slider = screen.getByRole("slider").closest<HTMLElement>(".mantine-Slider-root");
  expect(slider?.style.flex).toBe("1 1 12rem");
  expect(slider?.parentElement?.style.getPropertyValue("--group-wrap")).toBe("wrap");
});
