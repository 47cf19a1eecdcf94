import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { type LiveState, store } from "../../lib/live/store";
import { Angles } from "./Angles";

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

function show(ages_ms: (number | null)[]) {
  const axes = ages_ms.map((age_ms) => ({ measured_deg: 10, setpoint_deg: null, age_ms, torque: "unknown" }));
  const live = { device: "running", age_ms: 5, torque: "unknown", axes };
  const station = { axes: ages_ms.map(() => ({ min_deg: 0, max_deg: 90 })) };
  const state = { connected: true, heardAt: 0, station, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  render(
    <MantineProvider env="test">
      <Angles />
    </MantineProvider>,
  );
}

it("greys the angle of a drive that does not answer although the service lives", () => {
  show([5, 1200, null, 1199, 5]);
  const grey = [1, 2, 3, 4, 5].filter((axis) =>
    screen.getByTestId(`axis-${axis}`).classList.contains("stale"),
  );
  expect(grey).toEqual([2, 3]);
});
