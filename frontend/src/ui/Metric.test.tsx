import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { Metric } from "./Metric";

afterEach(cleanup);

it("lets a long Japanese value break, which would leave its tile", () => {
  const shown = (value: string) => {
    cleanup();
    render(
      <MantineProvider env="test">
        <Metric label="追従誤差" value={value} />
      </MantineProvider>,
    );
    return screen.getByText(value).style.whiteSpace;
  };
  expect(shown("ステーション3：増加")).toBe("normal");
  expect(shown("−7.2〜70.3°")).toBe("nowrap");
});

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
