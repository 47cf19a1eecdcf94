import { MantineProvider, Table } from "@mantine/core";
import { render, screen } from "@testing-library/react";
import { expect, it } from "vitest";
import { WideTable } from "./WideTable";

it("has its caption outside the scrolling area", () => {
  render(
    <MantineProvider env="test">
      <WideTable minWidth={900} caption="Errors of each motor">
        <Table.Tbody />
      </WideTable>
    </MantineProvider>,
  );
  expect(screen.getByRole("table", { name: "Errors of each motor" })).toBeTruthy();
  expect(
    screen.getByText("Errors of each motor").closest(".mantine-TableScrollContainer-scrollContainer"),
  ).toBeNull();
});
