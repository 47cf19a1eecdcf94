import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { StretchStatus } from "./StretchStatus";

afterEach(cleanup);

const HELD: Schemas["StretchLive"] = {
  phase: "hold",
  torque_nm: 1.84,
  target_nm: 2,
  hold_left_s: 11.2,
  held_s: 34.9,
  repetitions_left: 2,
};

function show(given: Partial<Schemas["StretchLive"]>) {
  render(
    <MantineProvider env="test">
      <StretchStatus stretch={{ ...HELD, ...given }} />
    </MantineProvider>,
  );
}

it("shows the phase, the torque and the counted time", () => {
  show({});
  expect(screen.getByText("Held, 12 s left")).toBeTruthy();
  expect(screen.getByText("1.8 of 2.0 Nm")).toBeTruthy();
  expect(screen.getByText(/Held for 34 s so far/)).toBeTruthy();
});

it("does not say of an arm at its largest angle that it is held with the torque", () => {
  show({ torque_nm: 1.1, held_s: 0 });
  expect(screen.getByText("Held with less than 60 % of the torque, 12 s left")).toBeTruthy();
});

it("shows no torque below zero", () => {
  show({ phase: "out", torque_nm: -1.2 });
  expect(screen.getByText("Towards the torque")).toBeTruthy();
  expect(screen.getByText("0.0 of 2.0 Nm")).toBeTruthy();
});
