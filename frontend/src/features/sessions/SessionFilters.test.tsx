import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { describeStop } from "./describeStop";
import { SessionFilters } from "./SessionFilters";
import { type Filters, readFilters, toQuery } from "./sessionFilters";

afterEach(cleanup);

function show(value: Filters) {
  const onChange = vi.fn();
  const choices = { therapists: ["Ito", "Sato"], stations: ["Station 1"], stops: ["estop_pressed"] };
  render(
    <MantineProvider env="test">
      <SessionFilters value={value} choices={choices} onChange={onChange} />
    </MantineProvider>,
  );
  return onChange;
}

describe("the filters of the sessions", () => {
  it("can be added one by one", () => {
    const onChange = show({ therapist: "Sato" });
    fireEvent.change(screen.getByLabelText("From"), { target: { value: "2026-11-01" } });
    fireEvent.click(screen.getByRole("combobox", { name: "Cause of stop" }));
    fireEvent.click(screen.getByRole("option", { name: "Emergency stop pressed" }));
    expect(onChange.mock.calls).toEqual([
      [{ therapist: "Sato", from: "2026-11-01" }],
      [{ therapist: "Sato", stop: "estop_pressed" }],
    ]);
  });

  it("can be removed one by one or together", () => {
    const onChange = show({ therapist: "Sato", to: "2026-11-01" });
    fireEvent.change(screen.getByLabelText("To"), { target: { value: "" } });
    fireEvent.click(screen.getByRole("button", { name: "Show all" }));
    expect(onChange.mock.calls).toEqual([[{ therapist: "Sato" }], [{}]]);
  });

  it("are counted on the button that unfolds them on a telephone", () => {
    show({ therapist: "Sato", to: "2026-11-01" });
    const button = screen.getByRole("button", { name: "Filters (2)" });
    const fields = screen.getByLabelText("From").closest(".mantine-SimpleGrid-root");
    expect(button.className).toContain("mantine-hidden-from-sm");
    expect([button.getAttribute("aria-expanded"), fields?.className]).toEqual([
      "false",
      expect.stringContaining("mantine-visible-from-sm"),
    ]);
    fireEvent.click(button);
    expect([button.getAttribute("aria-expanded"), fields?.className]).toEqual([
      "true",
      expect.not.stringContaining("mantine-visible-from-sm"),
    ]);
  });

  it("shows a value from the address without sessions", () => {
    show({ station: "Station 9" });
    expect(screen.getByRole("combobox", { name: "Station" })).toHaveProperty("value", "Station 9");
  });
});

describe("the address", () => {
  it("is read as far as it is valid", () => {
    const search = {
      from: "2026-11-01",
      to: "2026-13-01",
      therapist: "Sato",
      station: 5,
      page: 3,
      stop: null,
    };
    expect(readFilters(search)).toEqual({ from: "2026-11-01", therapist: "Sato", station: "5" });
  });

  it("contains local days, both inclusive", () => {
    const { since, until, station } = toQuery({
      from: "2026-11-01",
      to: "2026-11-01",
      station: "Station 1",
    });
    expect(station).toBe("Station 1");
    expect(since).toBe(new Date(2026, 10, 1).toISOString());
    expect(until).toBe(new Date(2026, 10, 2).toISOString());
    expect(toQuery({})).toEqual({});
  });

  it("may ask for unsigned notes only", () => {
    expect(readFilters({ note: "unsigned" })).toEqual({ note: "unsigned" });
    expect(readFilters({ note: "signed" })).toEqual({});
    expect(toQuery({ note: "unsigned" })).toEqual({ unsigned: true });
  });
});

it.each([
  ["estop_pressed", "Emergency stop pressed"],
  ["drive_silent", "Motor does not answer"],
])("the stop cause %s reads %s", (code, words) => expect(describeStop(code)).toBe(words));
