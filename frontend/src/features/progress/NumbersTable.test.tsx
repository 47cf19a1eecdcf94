import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen, within } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import * as csv from "../../lib/csv";
import { formatDayOf, formatMoment } from "../../lib/format";
import { withLocalDays } from "./days";
import { NumbersTable } from "./NumbersTable";

afterEach(cleanup);

const AT = "2026-03-02T09:30:00Z";

describe("the numbers behind a chart", () => {
  it("can be saved, and are shown on request with names, digits and local time", () => {
    render(
      <MantineProvider env="test">
        <NumbersTable
          name="tracking"
          title="Tracking"
          table={{
            columns: [
              { name: "Session", kind: "moment", digits: 0 },
              { name: "Recording", kind: "text", digits: 0 },
              { name: "RMSE, °", kind: "number", digits: 2 },
              { name: "Change", kind: "number", digits: 0 },
            ],
            rows: [
              [AT, "Lift", 1.234, -3],
              [AT, "Turn", 0, null],
            ],
            texts: [],
          }}
        />
      </MantineProvider>,
    );
    const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
    fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
    const header = '\ufeffSession,Recording,"RMSE, °",Change';
    expect(saved.mock.calls).toEqual([
      ["tracking.csv", `${header}\r\n${AT},Lift,1.234,-3\r\n${AT},Turn,0,\r\n`],
    ]);
    const button = screen.getByRole("button", { name: "Show numbers" });
    expect(button.getAttribute("aria-expanded")).toBe("false");
    expect(screen.queryByRole("table")).toBeNull();
    fireEvent.click(button);
    const table = screen.getByRole("table", { name: "Numbers: Tracking" });
    expect(within(table).getAllByRole("columnheader").map(text)).toEqual([
      "Session",
      "Recording",
      "RMSE, °",
      "Change",
    ]);
    expect(within(table).getAllByRole("cell").map(text)).toEqual([
      formatMoment(AT),
      "Lift",
      "1.23",
      "−3",
      formatMoment(AT),
      "Turn",
      "0.00",
      "–",
    ]);
    fireEvent.click(screen.getByRole("button", { name: "Hide numbers" }));
    expect(screen.queryByRole("table")).toBeNull();
  });
});

describe("a figure's days", () => {
  it("are those of the clinic", () => {
    const figure = { data: [{ x: [0], customdata: [AT] }, { x: [1, 2] }], layout: { height: 3 }, texts: [] };
    expect(withLocalDays(figure)).toEqual({
      data: [{ x: [0], customdata: [formatDayOf(AT)] }, { x: [1, 2] }],
      layout: { height: 3 },
      texts: [],
    });
  });
});

const text = (element: HTMLElement) => element.textContent;
