import { MantineProvider } from "@mantine/core";
import { act, cleanup, fireEvent, render, screen } from "@testing-library/react";
import { useState } from "react";
import { afterEach, expect, it, vi } from "vitest";
import type { PlotWindow } from "../../ui/plotWindow";
import { WindowSlider } from "./WindowSlider";

const heard = vi.fn();

function Harness() {
  const [window, setWindow] = useState<PlotWindow | null>(null);
  const hear = (to: PlotWindow | null) => {
    heard(to);
    setWindow(to);
  };
  return <WindowSlider length_s={9.96} window={window} onChange={hear} />;
}

function key(name: string, code: string) {
  const thumb = screen.getByRole("slider", { name });
  act(() => thumb.focus());
  fireEvent.keyDown(thumb, { key: code, code });
}

afterEach(() => {
  cleanup();
  heard.mockReset();
});

it("moves both ends by keys and resets when full", () => {
  render(
    <MantineProvider env="test">
      <Harness />
    </MantineProvider>,
  );
  expect(screen.getByTestId("window").textContent).toBe("Shown: 0.0\u00a0to\u00a010.0\u00a0s");
  key("From", "ArrowRight");
  expect(heard).toHaveBeenLastCalledWith({ start_s: 0.2, end_s: 10 });
  key("To", "ArrowLeft");
  expect(heard).toHaveBeenLastCalledWith({ start_s: 0.2, end_s: 9.8 });
  expect(screen.getByTestId("window").textContent).toBe("Shown: 0.2\u00a0to\u00a09.8\u00a0s");
  key("To", "ArrowRight");
  key("From", "ArrowLeft");
  expect(heard).toHaveBeenLastCalledWith(null);
  const all = screen.getByRole<HTMLButtonElement>("button", { name: "Whole recording" });
  expect(all.disabled).toBe(true);
  key("From", "ArrowRight");
  fireEvent.click(all);
  expect(heard).toHaveBeenLastCalledWith(null);
});
