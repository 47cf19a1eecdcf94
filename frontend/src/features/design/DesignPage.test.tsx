import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen, within } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { DesignPage } from "./DesignPage";
import { DENSITY, TYPE_SCALE } from "./designLanguage";

afterEach(cleanup);

it("shows each font in its own size, and a value without a sample once", () => {
  render(
    <MantineProvider env="test">
      <DesignPage />
    </MantineProvider>,
  );
  const samples = within(screen.getByRole("table", { name: "Type scale" })).getAllByText("Design language");
  expect(samples.map(({ style }) => `${style.fontWeight} ${style.fontSize}/${style.lineHeight}`)).toEqual(
    TYPE_SCALE.map(({ value }) => value),
  );
  const density = within(screen.getByRole("table", { name: "Density" })).getAllByRole("row");
  expect(density.map((row) => row.children.length)).toEqual(DENSITY.map(() => 1));
});
