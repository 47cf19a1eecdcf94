import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { lastLevel, ResistanceLevel } from "./ResistanceLevel";

afterEach(cleanup);

function show(value: number, last: number | null = null, highest: number | null = null) {
  const onChange = vi.fn();
  render(
    <MantineProvider>
      <ResistanceLevel value={value} last={last} highest={highest} onChange={onChange} />
    </MantineProvider>,
  );
  return onChange;
}

describe("the resistance level", () => {
  it("goes up and down by one", () => {
    const onChange = show(8);
    fireEvent.click(screen.getByRole("button", { name: "One level higher" }));
    fireEvent.click(screen.getByRole("button", { name: "One level lower" }));
    expect(onChange.mock.calls).toEqual([[9], [7]]);
  });

  it("is set by the keyboard", () => {
    const onChange = show(8);
    const slider = screen.getByRole("slider", { name: "Resistance level" });
    fireEvent.keyDown(slider, { key: "ArrowRight" });
    expect(onChange).toHaveBeenCalledWith(9);
  });

  it.each([
    [1, "One level lower"],
    [25, "One level higher"],
  ])("stops at %d", (value, name) => {
    show(value);
    expect(screen.getByRole("button", { name }).hasAttribute("disabled")).toBe(true);
  });

  it("stops at the doctor's limit and says so", () => {
    const onChange = show(12, null, 12);
    expect(screen.getByRole("button", { name: "One level higher" }).hasAttribute("disabled")).toBe(true);
    fireEvent.keyDown(screen.getByRole("slider", { name: "Resistance level" }), { key: "ArrowRight" });
    expect(onChange.mock.calls.flat().every((level) => level <= 12)).toBe(true);
    expect(screen.getByText("The doctor's limits allow at most level 12.")).toBeTruthy();
  });

  it("marks the level of the last run", () => {
    show(8, 8);
    expect(screen.getByTestId("level").textContent).toBe("8\u00a0of\u00a025, as last time");
    cleanup();
    show(9, 8);
    expect(screen.getByTestId("level").textContent).toBe("9\u00a0of\u00a025");
  });
});

describe("the last level", () => {
  it("is that of the newest run with a level", () => {
    expect(lastLevel([{ resistance_level: 5 }, { resistance_level: 8 }, { resistance_level: null }])).toBe(8);
  });

  it("is absent if no run has a level", () => {
    expect(lastLevel([{ resistance_level: null }])).toBeNull();
    expect(lastLevel([])).toBeNull();
  });
});
