import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { SelfPacedChoice, SelfPacedStatus } from "./SelfPaced";

afterEach(cleanup);

const onChange = vi.fn();

function choose(given: Partial<Parameters<typeof SelfPacedChoice>[0]>) {
  render(
    <MantineProvider env="test">
      <SelfPacedChoice permitted method="smooth" value={false} onChange={onChange} {...given} />
    </MantineProvider>,
  );
}

it("is off until the therapist chooses it", () => {
  choose({});
  const box = screen.getByRole("checkbox", { name: "The patient sets the pace" });
  expect(box).toHaveProperty("checked", false);
  fireEvent.click(box);
  expect(onChange).toHaveBeenCalledWith(true);
});

it("is not offered without the doctor's permission", () => {
  choose({ permitted: false, value: true });
  expect(screen.queryByRole("checkbox")).toBeNull();
});

it("says why a prescribed choice is not offered", () => {
  choose({ permitted: false, prescribed: true });
  expect(screen.queryByRole("checkbox")).toBeNull();
  expect(screen.getByRole("note").textContent).toContain("Without the doctor's permission");
});

it("is not offered for another method", () => {
  choose({ method: "paper", value: true });
  const box = screen.getByRole("checkbox");
  expect(box).toHaveProperty("disabled", true);
  expect(box).toHaveProperty("checked", false);
});

it("shows no pace while the recording rests before its motion", () => {
  render(
    <MantineProvider env="test">
      <SelfPacedStatus pacing={{ pace_percent: 100, effort_nm: 0, threshold_nm: 0, work_j: 0 }} />
    </MantineProvider>,
  );
  expect(screen.getByText("The motion has not begun yet.")).toBeTruthy();
  expect(screen.queryByText(/Pace/)).toBeNull();
});

it("shows pace, effort and work", () => {
  render(
    <MantineProvider env="test">
      <SelfPacedStatus pacing={{ pace_percent: 62.4, effort_nm: 1.84, threshold_nm: 0.8, work_j: 3.26 }} />
    </MantineProvider>,
  );
  expect(screen.getByText("Pace: 62 % of the set speed")).toBeTruthy();
  expect(screen.getByText("Effort: 1.8 Nm")).toBeTruthy();
  expect(screen.getByText(/Work so far: 3.3 J/)).toBeTruthy();
  expect(screen.getByText(/above 0.8 Nm/)).toBeTruthy();
});
