import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { useState } from "react";
import { afterEach, expect, it, vi } from "vitest";
import { DateField } from "./DateField";

const onChange = vi.fn();

/** The field of a filter, which ignores texts that are no day, or of a form, which takes all. */
function Field({ first = "", form = false }: { first?: string; form?: boolean }) {
  const [value, setValue] = useState(first);
  return (
    <MantineProvider env="test">
      <DateField
        label="From"
        value={value}
        max="2026-11-28"
        onChange={(day) => {
          onChange(day);
          if (form || /^(\d{4}-\d{2}-\d{2})?$/.test(day)) setValue(day);
        }}
      />
      <button type="button" onClick={() => setValue("2026-01-02")}>
        Reset
      </button>
    </MantineProvider>
  );
}

const field = () => screen.getByRole("textbox", { name: "From" }) as HTMLInputElement;

function type(text: string) {
  fireEvent.change(field(), { target: { value: text } });
  fireEvent.blur(field());
}

afterEach(() => {
  cleanup();
  onChange.mockReset();
});

it("takes a typed day, and shows it in words", () => {
  render(<Field />);
  type("2026/3/9");
  expect(onChange.mock.calls).toEqual([["2026-03-09"]]);
  expect(field().value).toBe("Mar 9, 2026");
});

it("takes no half-typed day", () => {
  render(<Field />);
  fireEvent.change(field(), { target: { value: "2026/1/1" } });
  expect(onChange).not.toHaveBeenCalled();
  fireEvent.change(field(), { target: { value: "2026/1/12" } });
  fireEvent.keyDown(field(), { key: "Enter" });
  expect(onChange.mock.calls).toEqual([["2026-01-12"]]);
});

it.each([false, true])("keeps a wrong text and names the error (in a form: %s)", (form) => {
  render(<Field first="2026-03-09" form={form} />);
  type("30 Feb 2026");
  expect(field().value).toBe("30 Feb 2026");
  expect(screen.getByText(/“30 Feb 2026” does not exist/)).toBeTruthy();
  expect(field().getAttribute("aria-invalid")).toBe("true");
  type("soon");
  expect(screen.getByText(/“soon” is no date/)).toBeTruthy();
  type("2026-11-29");
  expect(screen.getByText(/must not be after Nov 28, 2026/)).toBeTruthy();
  type("2026-11-28");
  expect(field().getAttribute("aria-invalid")).toBeNull();
});

it("can be emptied, and follows the page", () => {
  render(<Field first="2026-03-09" />);
  type("");
  expect(onChange.mock.calls).toEqual([[""]]);
  type("soon");
  fireEvent.click(screen.getByRole("button", { name: "Reset" }));
  expect(field().value).toBe("Jan 2, 2026");
  expect(field().getAttribute("aria-invalid")).toBeNull();
});

it("opens the calendar, and takes the picked day", () => {
  const showPicker = vi.fn();
  HTMLInputElement.prototype.showPicker = showPicker;
  const { container } = render(<Field />);
  fireEvent.click(screen.getByRole("button", { name: "Pick From in a calendar" }));
  expect(showPicker).toHaveBeenCalled();
  fireEvent.change(container.querySelector("input[type=date]") as Element, {
    target: { value: "2026-05-06" },
  });
  expect(onChange.mock.calls).toEqual([["2026-05-06"]]);
  expect(field().value).toBe("May 6, 2026");
});
