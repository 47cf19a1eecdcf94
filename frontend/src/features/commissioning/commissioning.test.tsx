import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { api } from "../../lib/api/client";
import { CommissioningState, stateWords } from "./CommissioningState";
import { readCommissioningSearch } from "./commissioningTabs";
import { driftFigure, driftTable, type Entry, measured } from "./driftCharts";
import { comparedRows, motorRows } from "./SettingsTab";
import { acceptedWords, fieldWords, recordedWords } from "./settingWords";

const state: Schemas["CommissioningState"] = {
  state: "commissioned",
  reason: "",
  reason_key: null,
  commissioned_at: "2026-03-02T10:00:00Z",
  due_at: "2026-03-09T10:00:00Z",
};

describe("the state", () => {
  afterEach(cleanup);

  it("names the days", () => {
    expect(stateWords(state)).toBe("Commissioned on Mar 2, 2026. Periodic check due on Mar 9, 2026.");
    expect(stateWords({ ...state, state: "due" })).toMatch(/has been due since Mar 9, 2026/);
  });

  it("alerts with the reason when patients are refused", async () => {
    const refused = { ...state, state: "not_commissioned" as const, reason: "there is no record" };
    vi.spyOn(api, "commissioningStatus").mockResolvedValue(refused);
    render(
      <MantineProvider>
        <QueryClientProvider client={new QueryClient()}>
          <CommissioningState />
        </QueryClientProvider>
      </MantineProvider>,
    );
    expect((await screen.findByRole("alert")).textContent).toMatch(
      /there is no record\..*No patient can be treated/,
    );
  });
});

const entry = (ended_at: string, friction: number | null, play: number | null = null) =>
  ({
    ended_at,
    figures: [1, 2, 3, 4, 5].map((motor) => ({ motor, friction_deg: friction, play_deg: play })),
  }) as unknown as Entry;

describe("drift", () => {
  const entries = [entry("2026-03-09T10:00:00Z", 0.2), entry("2026-03-02T10:00:00Z", 0.1, 0.25)];

  it("shows the records that measured a figure, oldest first", () => {
    expect(measured(entries, "friction_deg").map((one) => one.ended_at)).toEqual([
      "2026-03-02T10:00:00Z",
      "2026-03-09T10:00:00Z",
    ]);
    expect(measured(entries, "play_deg")).toHaveLength(1);
  });

  it("has the same numbers in chart and table", () => {
    const own = measured(entries, "friction_deg");
    expect(driftFigure(own, "friction_deg").data[4]).toMatchObject({ y: [0.1, 0.2] });
    expect(driftTable(own, "friction_deg").rows.map((row) => row[5])).toEqual([0.1, 0.2]);
  });
});

describe("two versions", () => {
  const field = (name: string, value: string) => ({ name, value, unit: "", accepted: null });

  it("are compared by field, with fields that only one has", () => {
    const rows = comparedRows({
      settings: { number: 2, fields: [field("baud", "2"), field("new", "1")] },
      other: { number: 1, fields: [field("baud", "1"), field("gone", "3")] },
    });
    expect(rows.map(({ name, value, before }) => [name, value, before])).toEqual([
      ["baud", "2", "1"],
      ["new", "1", ""],
      ["gone", "", "3"],
    ]);
  });
});

it("the settings of the motors are one row for each field", () => {
  const fields = ["baud", "axes[1].id", "axes[1].lag_s", "axes[2].id"];
  const rows = motorRows(fields.map((name) => ({ name, value: `of ${name}`, unit: "", accepted: null })));
  expect(
    rows.map(({ field, settings }) => [field, [...settings].map(([n, { value }]) => [n, value])]),
  ).toEqual([
    [
      "id",
      [
        [1, "of axes[1].id"],
        [2, "of axes[2].id"],
      ],
    ],
    ["lag_s", [[1, "of axes[1].lag_s"]]],
  ]);
});

describe("the words of a station's file", () => {
  const accepted = { low: 0, high: 508, choices: [], step: null, none: null };

  it("say which values a field accepts", () => {
    expect(acceptedWords(null)).toBe("");
    expect(acceptedWords({ ...accepted, low: -9600.5 })).toBe("-9,600.5 to 508");
    expect(acceptedWords({ ...accepted, step: 2 })).toBe("0 to 508 in steps of 2");
    expect(acceptedWords({ ...accepted, none: -1 })).toBe("0 to 508, or -1 for none");
    expect(acceptedWords({ ...accepted, choices: [-1, 1] })).toBe("One of -1, 1");
  });

  it("explain a field of an axis and a driver's own setting", () => {
    expect(fieldWords("axes[2].lag_s")).toBe("Lag");
    expect(fieldWords("inputs.estop_port")).toBe("Input of the emergency stop");
    expect(fieldWords("driver.speed")).toBe("Setting of the driver");
    expect(fieldWords("later")).toBe("");
  });

  it("name what a record contains, with its varying parts", () => {
    expect(recordedWords("motion 3, weight: peak error deg")).toBe(
      "Motion 3, with the test weight: peak error, deg",
    );
    expect(recordedWords("weight at 60 deg, Nm")).toBe("Weight at 60 deg, Nm");
    expect(recordedWords("of a later version")).toBe("of a later version");
  });
});

it("the address holds tab and versions", () => {
  expect(readCommissioningSearch({ tab: "settings", version: 2, other: 1 })).toEqual({
    tab: "settings",
    version: 2,
    other: 1,
  });
  expect(readCommissioningSearch({ tab: "nonsense", version: -1, other: "x" })).toEqual({});
});
