import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { Metric } from "./Metric";

afterEach(cleanup);

it("breaks the line before the unit, and never within it", () => {
  render(
    <MantineProvider env="test">
      <Metric label="Done" value="2 of 2" unit="repetitions done" testid="done" />
    </MantineProvider>,
  );
  expect(screen.getByTestId("done").textContent).toBe("Done2 of 2 repetitions done");
  // The unit does not wrap, so a space inside it would hold it to the value.
  expect(screen.getByText("repetitions done").textContent).toBe("repetitions done");
});
