import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, within } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api } from "../../lib/api/client";
import { RhythmOfRecording, RhythmOfRun } from "./RhythmCard";
import { type Curve, describePlane, type Rhythm, rhythmFigure } from "./rhythmFigure";

afterEach(cleanup);

const band = (from_deg: number, ratio: number | null) => ({
  from_deg,
  to_deg: from_deg + 30,
  ratio,
  reason: ratio === null ? ("at_limit" as const) : null,
  scapula_deg: 8,
  joint_deg: 22,
  passes: 1,
});
const curve = (given: Partial<Curve>): Curve => ({
  of: "taught",
  direction: "raising",
  plane: "abduction",
  plane_deg: -4,
  passes: 3,
  elevation_deg: [30.5, 31.5],
  scapula_deg: [4, 4.4],
  bands: [band(30, 2.75), band(60, null)],
  whole: { ...band(30, 2.6), to_deg: 71 },
  reference: { source: "giphart_2013", ratio: 2, ratio_deviation: 0.4 },
  ...given,
});
const rhythm = (given: Partial<Rhythm>): Rhythm => ({
  side: "left",
  recording_id: "r",
  run_id: null,
  moved_at: "2026-11-02T09:00:00Z",
  elevation_min_deg: 12,
  elevation_max_deg: 95,
  scapula_min_deg: -1,
  scapula_max_deg: 20,
  curves: [curve({}), curve({ direction: "lowering", reference: null })],
  sound: null,
  no_sound: "no_recording",
  leads: [],
  ...given,
});

function show(card: ReactNode) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>{card}</TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
}

it("shows ratios, reasons and the published ratio of each direction", async () => {
  vi.spyOn(api, "recordingRhythm").mockResolvedValue(rhythm({}));
  show(<RhythmOfRecording recordingId="r" />);
  const [, raising, lowering] = within(await screen.findByTestId("ratios")).getAllByRole("row");
  expect(raising?.textContent).toContain("2.8Scapula at the apparatus' limit2.6 (30\u00a0to\u00a071°)");
  expect(raising?.textContent).toContain("2.0, standard deviation 0.4 (Giphart et al., 2013)");
  expect(lowering?.textContent).toContain("No published value for this plane and direction");
  expect(screen.getByText(/not of bones/)).toBeTruthy();
  expect(screen.getByText(/no motion of the unaffected side has been taught/)).toBeTruthy();
  expect(screen.getByRole("figure")).toBeTruthy();
  fireEvent.click(screen.getByRole("button", { name: "Show numbers" }));
  expect(screen.getByRole("columnheader", { name: "Taught, raising, °" })).toBeTruthy();
});

it("distinguishes a range that the arm did not cover from a pass that is too short", async () => {
  const uncovered = { ...band(30, null), reason: "not_covered" as const };
  vi.spyOn(api, "recordingRhythm").mockResolvedValue(
    rhythm({ curves: [curve({ bands: [uncovered], whole: { ...uncovered, to_deg: 52 } })] }),
  );
  show(<RhythmOfRecording recordingId="r" />);
  const [, raising] = within(await screen.findByTestId("ratios")).getAllByRole("row");
  expect(raising?.textContent).toContain("Arm did not cover all of this rangeToo short to calculate2.0");
});

it("says where the scapula is ahead of the unaffected side", async () => {
  const lead = { from_deg: 13, to_deg: 74, largest_deg: 8.04, at_elevation_deg: 32, ahead_from_deg: 22 };
  vi.spyOn(api, "runRhythm").mockResolvedValue(
    rhythm({
      sound: { recording_id: "s", name: "Sound arm", side: "right", taught_at: "2026-11-01T09:00:00Z" },
      no_sound: null,
      leads: [
        { of: "played", ...lead },
        { of: "taught", ...lead, largest_deg: -3, ahead_from_deg: null },
      ],
    }),
  );
  show(<RhythmOfRun runId="r" />);
  expect(await screen.findByText(/^Played: from 22° .* the scapula is ahead .* 8.0° at 32°/)).toBeTruthy();
  expect(screen.getByText(/^Taught: the scapula is not ahead .* −3.0°/)).toBeTruthy();
  expect(screen.getByText(/not a diagnosis/)).toBeTruthy();
  expect(screen.getByRole("link", { name: "Sound arm" }).getAttribute("href")).toBe("/recordings/s");
});

it("gives ranges instead of a ratio when the arm was not raised", async () => {
  vi.spyOn(api, "runRhythm").mockResolvedValue(rhythm({ curves: [], elevation_max_deg: 21 }));
  show(<RhythmOfRun runId="r" />);
  expect(await screen.findByText(/No ratio: .* from 12° to 21°, .* from −1° to 20°/)).toBeTruthy();
  expect(screen.queryByRole("figure")).toBeNull();
});

it("draws a line for each curve and the apparatus' limit", () => {
  const curves = [curve({}), curve({ plane: "flexion", plane_deg: 88 }), curve({ of: "sound" })];
  expect(rhythmFigure(rhythm({ curves })).data.map(({ name }) => name)).toEqual([
    "Limit of the apparatus",
    "Unaffected side, raising",
    "Taught, raising, Flexion (88°)",
    "Taught, raising, Abduction (−4°)",
  ]);
});

it("names a plane without a negative zero", () => {
  expect(describePlane(curve({ plane_deg: -0.3 }))).toBe("Abduction (0°)");
});
