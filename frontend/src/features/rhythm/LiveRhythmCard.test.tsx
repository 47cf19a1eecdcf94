import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, render, screen, within } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Live, type Schemas } from "../../lib/api/client";
import { store } from "../../lib/live/store";
import { motorsOf } from "../digital-twin/linkage";
import { LiveRhythmCard } from "./LiveRhythmCard";

const ELEVATIONS = Array.from({ length: 70 }, (_, n) => 12.5 + n);
const band = (from_deg: number, ratio: number | null): Schemas["RhythmBand"] => ({
  from_deg,
  to_deg: from_deg + 30,
  ratio,
  reason: ratio === null ? "not_covered" : null,
  scapula_deg: 6,
  joint_deg: 24,
  passes: 1,
});
const curve = (of: Schemas["RhythmCurve"]["of"], ratio: number): Schemas["RhythmCurve"] => ({
  of,
  direction: "raising",
  plane: "abduction",
  plane_deg: 0,
  passes: 1,
  elevation_deg: ELEVATIONS,
  scapula_deg: ELEVATIONS.map((deg) => (deg - 12) / (1 + ratio)),
  bands: [band(30, ratio), band(60, null)],
  whole: band(30, ratio),
  reference: null,
});
const SOUND: Schemas["SoundRhythm"] = {
  side: "right",
  no_sound: null,
  motions: [
    {
      recording: { recording_id: "s", name: "Sound arm", side: "right", taught_at: "2026-11-01T09:00:00Z" },
      start_elevation_deg: 12,
      start_scapula_deg: 0,
      curves: [curve("sound", 4)],
    },
  ],
};

let listeners: (() => void)[] = [];
let live: Partial<Live>;

beforeEach(() => {
  listeners = [];
  live = { side: "left", device: "running", age_ms: 10, rhythm: null, axes: [], run: null, teaching: null };
  vi.spyOn(store, "get").mockImplementation(() => ({
    connected: true,
    heardAt: 0,
    station: null,
    live: live as Live,
    events: [],
  }));
  vi.spyOn(store, "subscribe").mockImplementation((listener) => {
    listeners.push(listener);
    return () => {};
  });
});
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

/** Send a state with the arm raised in abduction while a recording is played or, after resistance, the arm is moved back. */
function raise(
  elevation_deg: number,
  scapula_deg: number,
  curves: Schemas["RhythmCurve"][] = [],
  reversing = false,
) {
  const scapula = motorsOf({ phi_deg: 0, psi_deg: scapula_deg }, "left") ?? [0, 0];
  const angles = [...scapula, elevation_deg - scapula_deg, 0, 0];
  live = {
    ...live,
    mode: "playing",
    run: { reversing } as Schemas["RunLive"],
    rhythm: { motion_id: "run", start_elevation_deg: 12, start_scapula_deg: 0, curves },
    axes: angles.map((measured_deg) => ({ measured_deg })) as Live["axes"],
  };
  act(() => {
    for (const listener of listeners) listener();
  });
}

async function show(sound = SOUND) {
  vi.spyOn(api, "soundRhythm").mockResolvedValue(sound);
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>
          <LiveRhythmCard patientId="p" />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
  await screen.findByText(/Compared with the unaffected side|No comparison|This is the unaffected side/);
}

it("says while the scapula runs ahead of the unaffected side, and how far", async () => {
  await show();
  for (let deg = 12; deg <= 50; deg += 2) raise(deg, (deg - 12) / 5 + (deg - 12) / 6);
  expect(within(screen.getByRole("status")).getByText(/runs ahead of the unaffected side/)).toBeTruthy();
  expect(screen.getByTestId("lead").textContent).toContain("unaffected side: 6.3°");
  expect(screen.getByTestId("lead").textContent).toContain("Largest: 6.3° at 50°");
  expect(screen.getByTestId("arm-now").textContent).toBe("Arm 50°, scapula 13.9°");
});

it("follows the arm while it is moved back, without counting it as part of the motion", async () => {
  await show();
  for (let deg = 12; deg <= 50; deg += 2) raise(deg, (deg - 12) / 5 + (deg - 12) / 6);
  raise(20, 1, [], true);
  expect(screen.getByTestId("arm-now").textContent).toBe("Arm 20°, scapula 1.0°");
  expect(screen.getByTestId("lead").textContent).toContain("Largest: 6.3° at 50°");
});

it("says nothing while the scapula turns like the unaffected side's", async () => {
  await show();
  for (let deg = 12; deg <= 60; deg += 2) raise(deg, (deg - 12) / 5);
  expect(screen.queryByTestId("runs-ahead")).toBeNull();
  expect(screen.getByTestId("lead").textContent).toContain("unaffected side: 0.0°");
});

it("shows the ratio of each phase beside the unaffected side's", async () => {
  await show();
  raise(40, 5, [curve("played", 2.5)]);
  const [, own, other] = within(screen.getByTestId("live-ratios")).getAllByRole("row");
  expect(own?.textContent).toContain("Played, raising2.5Arm did not cover all of this range");
  expect(other?.textContent).toContain("Unaffected side, raising4.0Arm did not cover all of this range");
});

it("does not compare the unaffected side with itself", async () => {
  live = { ...live, side: "right" };
  await show();
  expect(screen.getByText("This is the unaffected side.")).toBeTruthy();
});

it("says why there is no comparison", async () => {
  await show({ side: "right", no_sound: "no_recording", motions: [] });
  expect(screen.getByText(/no motion of the unaffected side has been taught/)).toBeTruthy();
  expect(screen.getByText(/begins with the take or the playback/)).toBeTruthy();
});
