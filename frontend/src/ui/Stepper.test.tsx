import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { Stepper } from "./Stepper";

afterEach(cleanup);

it("adds steps of a tenth without binary fractions", () => {
  const onChange = vi.fn();
  render(
    <MantineProvider>
      <Stepper
        field={{ label: "Torque", unit: "Nm", min: 0.5, max: 4, step: 0.1 }}
        value={0.7}
        onChange={onChange}
      />
    </MantineProvider>,
  );
  fireEvent.click(screen.getByRole("button", { name: "Torque: increase" }));
  expect(onChange).toHaveBeenCalledWith(0.8);
});
