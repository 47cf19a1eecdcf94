import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, within } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import type { Schemas } from "../../lib/api/client";
import { api } from "../../lib/api/client";
import { CommissioningState, describeState } from "./CommissioningState";
import { readCommissioningSearch } from "./commissioningTabs";
import { describeAcceptedValues, describeField, describeRecordedValue, withMinus } from "./describeSetting";
import { driftFigure, driftTable, type Entry, measured } from "./driftCharts";
import { GainTuning } from "./GainTuning";
import { SignatureNote } from "./RecordsTab";
import { comparisons, newest, type Response, responseTable } from "./responseCharts";
import { comparedRows, HistoryTab, motorRows } from "./SettingsTab";

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
    expect(describeState(state)).toBe(
      "Commissioned on Mar\u00a02,\u00a02026. Periodic check due on Mar\u00a09,\u00a02026.",
    );
    expect(describeState({ ...state, state: "due" })).toMatch(/has been due since Mar\u00a09,\u00a02026/);
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

describe("the signature of a record", () => {
  afterEach(cleanup);
  const shown = (state: Schemas["CommissioningSignature"]["state"], changed: string[] = []) =>
    render(
      <MantineProvider>
        <SignatureNote signature={{ state, changed, public_key: "ab12" }} />
      </MantineProvider>,
    );

  it("alerts with what was changed", () => {
    shown("changed", ["done_by", "figures"]);
    expect(screen.getByRole("alert").textContent).toMatch(/was changed.*: done_by, figures\./);
  });

  it("names the key of a valid signature, and says if there is none", () => {
    shown("valid");
    expect(screen.getByText(/signature is valid.*ab12/)).toBeTruthy();
    shown("unsigned");
    expect(screen.getByText(/not signed/)).toBeTruthy();
    expect(screen.queryByRole("alert")).toBeNull();
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
    expect(describeAcceptedValues(null)).toBe("");
    expect(describeAcceptedValues({ ...accepted, low: -9600.5 })).toBe("−9600.5\u00a0to\u00a0508");
    expect(describeAcceptedValues({ ...accepted, high: 16383 })).toBe("0\u00a0to\u00a016383");
    expect(describeAcceptedValues({ ...accepted, step: 2 })).toBe("0\u00a0to\u00a0508 in steps of 2");
    expect(describeAcceptedValues({ ...accepted, none: -1 })).toBe("0\u00a0to\u00a0508, or −1 for none");
    expect(describeAcceptedValues({ ...accepted, choices: [-1, 1] })).toBe("One of −1, 1");
    expect(describeAcceptedValues({ ...accepted, choices: [1120, 1000000] })).toBe("One of 1120, 1000000");
  });

  it("have minus signs, and no other hyphen is replaced", () => {
    expect(withMinus("-19")).toBe("−19");
    expect(withMinus("0, -0.5, 2e-3, /dev/tty-1")).toBe("0, −0.5, 2e-3, /dev/tty-1");
  });

  it("explain a field of an axis and a driver's own setting", () => {
    expect(describeField("axes[2].lag_s")).toBe("Lag");
    expect(describeField("inputs.estop_port")).toBe("Input of the emergency stop");
    expect(describeField("driver.speed")).toBe("Setting of the driver");
    expect(describeField("later")).toBe("");
  });

  it("name what a record contains, with its varying parts", () => {
    expect(describeRecordedValue("motion 3, weight: peak error deg")).toBe(
      "Motion 3, with the test weight: peak error, °",
    );
    expect(describeRecordedValue("weight at 60 deg, Nm")).toBe("Weight at 60°, Nm");
    expect(describeRecordedValue("of a later version")).toBe("of a later version");
  });
});

describe("the tuning of gains", () => {
  afterEach(cleanup);
  const gains = { p: 1600, i: 800, d: 300 };
  const figures = { rise_s: 0.1, overshoot: 0.3, steady_error_deg: 0.02 };
  const tuning = (motor: number): Schemas["MotorTuning"] => ({
    motor,
    gains,
    response: figures,
    former_gains: null,
    former_response: null,
    proposed: motor === 3 ? { ...gains, d: 500 } : gains,
    advice: motor === 3 ? "It overshoots: more damping." : "",
    advice_key: null,
    lowest: { p: 800, i: 400, d: 150 },
    highest: { p: 3200, i: 1600, d: 600 },
  });
  const review: Schemas["GainTuningReview"] = {
    load: "weight",
    motors: [1, 2, 3, 4, 5].map(tuning),
    curves: [],
    former_curves: [],
    fault: "",
    fault_key: null,
  };
  const curve = (motor: number, d_gain: number, angle: number): Response => ({
    motor,
    load: "weight",
    step_deg: 2,
    p_gain: 1600,
    i_gain: 800,
    d_gain,
    times_s: [0, 1],
    angles_deg: [0, angle],
  });

  function shown(of: Schemas["GainTuningReview"]) {
    const answers: Schemas["GainsAnswer"][] = [];
    render(
      <MantineProvider>
        <GainTuning review={of} busy={false} onAnswer={(answer) => answers.push(answer)} />
      </MantineProvider>,
    );
    return answers;
  }
  const button = (name: string) => screen.getByRole<HTMLButtonElement>("button", { name });
  const field = (name: string) => screen.getByRole<HTMLInputElement>("textbox", { name });

  it("fills in the proposal and measures with it", () => {
    const answers = shown(review);
    expect(screen.getByText(/proposes other gains for motors 3\./)).toBeTruthy();
    expect(field("Motor\u00a03, Derivative gain (no unit), next measurement").value).toBe("500");
    expect(screen.queryByRole("button", { name: "Take back" })).toBeNull();
    fireEvent.click(button("Measure with the new gains (motors move)"));
    expect(answers).toEqual([
      { action: "measure", gains: [gains, gains, { ...gains, d: 500 }, gains, gains] },
    ]);
  });

  it("refuses gains outside the limits, and unchanged gains", () => {
    shown({ ...review, motors: review.motors.map((motor) => ({ ...motor, proposed: gains })) });
    expect(button("Measure with the new gains (motors move)").disabled).toBe(true);
    const p = field("Motor\u00a02, Proportional gain (no unit), next measurement");
    fireEvent.change(p, { target: { value: "3201" } });
    expect(screen.getByText("Outside 800 to 3200")).toBeTruthy();
    expect(button("Measure with the new gains (motors move)").disabled).toBe(true);
    fireEvent.change(p, { target: { value: "3200" } });
    expect(button("Measure with the new gains (motors move)").disabled).toBe(false);
  });

  it("shows both rows of a changed motor and takes back in one press", () => {
    const former = { former_gains: { ...gains, d: 700 }, former_response: { ...figures, overshoot: 0.05 } };
    const answers = shown({
      ...review,
      motors: review.motors.map((motor) => ({
        ...motor,
        ...(motor.motor === 3 ? former : { former_gains: gains, former_response: figures }),
      })),
    });
    const row = (which: string) => within(screen.getByTestId(`motor-3-${which}`));
    expect(
      row("former")
        .getAllByRole("cell")
        .slice(-4)
        .map((cell) => cell.textContent),
    ).toEqual(["700", "0.10", "5", "0.02"]);
    expect(row("present").getAllByRole("cell").slice(-2)[0]?.textContent).toBe("30");
    expect(screen.queryByTestId("motor-2-former")).toBeNull();
    fireEvent.click(button("Take back"));
    expect(answers).toEqual([{ action: "take_back" }]);
  });

  it("says with which fault the gains end the step", () => {
    shown({ ...review, fault: "Motor 3 overshoots." });
    expect(screen.getByRole("status").textContent).toMatch(/ends with a fault: Motor\u00a03 overshoots/);
  });

  it("draws former and present response of changed motors in one chart", () => {
    const responses = [curve(1, 300, 2), curve(3, 300, 3), curve(1, 300, 2), curve(3, 500, 2)];
    const [compared, ...others] = comparisons(responses);
    expect(others).toEqual([]);
    expect(compared?.motor).toBe(3);
    expect(compared?.figure.data.slice(1)).toMatchObject([
      { name: "Former", y: [0, 3] },
      { name: "Present", y: [0, 2] },
    ]);
    expect(newest(responses)).toEqual(responses.slice(2));
    expect(compared?.table.columns.map(({ name }) => name)).toEqual([
      "Time (s)",
      "Former, Angle (°)",
      "Present, Angle (°)",
    ]);
    expect(compared?.table.rows).toEqual([
      [0, 0, 0],
      [1, 3, 2],
    ]);
  });

  it("lists the angles of all motors by time, also if their times differ", () => {
    const table = responseTable([curve(1, 300, 2), { ...curve(2, 300, 3), times_s: [0, 0.5] }]);
    expect(table.columns.map(({ name }) => name)).toEqual([
      "Time (s)",
      "Motor\u00a01, Angle (°)",
      "Motor\u00a02, Angle (°)",
    ]);
    expect(table.rows).toEqual([
      [0, 0, 0],
      [0.5, null, 3],
      [1, 2, null],
    ]);
  });
});

describe("the history of the configuration", () => {
  afterEach(cleanup);

  it("leads from each version to the comparison with the version before", () => {
    const version = (number: number, changed_by: string) =>
      ({ number, since: "2026-03-02T10:00:00Z", changed_by, software: "1.0.0" }) as Schemas["StationVersion"];
    render(
      <MantineProvider env="test">
        <TestRouter>
          <HistoryTab versions={[version(3, "Ito Mai"), version(2, ""), version(1, "")]} more />
        </TestRouter>
      </MantineProvider>,
    );
    screen.getByText(/^3 rows are shown; there are more/);
    expect(screen.getAllByRole("link").map((link) => link.getAttribute("href"))).toEqual([
      "/commissioning?tab=settings&version=3&other=2",
      "/commissioning?tab=settings&version=2&other=1",
    ]);
    fireEvent.click(screen.getByRole("button", { name: "Version" }));
    expect(within(screen.getAllByRole("row")[1] as HTMLElement).getByText("First version")).toBeTruthy();
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
