/** The tiles of a session, its numbers and its comparison show the same figure alike. The patient's page shows the same tiles. */
import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import type { Run, Session } from "../../lib/api/client";
import { compareSessions } from "./compareSessions";
import { RunNumbers } from "./RunNumbers";
import { ResultMetrics } from "./SessionResult";

const errors = (name: object, peak_deg: number, [low, high]: [number, number]) => ({
  ...name,
  peak_deg,
  peak_at_s: 1,
  rmse_deg: 0.4,
  start_deg: 0,
  taught_min_deg: low,
  taught_max_deg: high,
  played_min_deg: low,
  played_max_deg: high,
});

const session = (peak_deg: number, range: [number, number]) =>
  ({
    side: "left",
    pain_before: 5,
    pain_during: 6,
    pain_after: 4,
    runs: [
      {
        id: "r",
        recording_id: "a",
        recording_name: "Abduction",
        outcome: "completed",
        side: "left",
        partial: false,
        repetitions: 3,
        repetitions_done: 3,
        learning: [],
        started_at: "2026-11-21T09:10:00Z",
        comparison: {
          samples: 100,
          motors: [errors({ motor: 3 }, peak_deg, range)],
          motions: [errors({ motion: 4, name: "Abduction" }, peak_deg, range)],
        },
      },
    ],
  }) as unknown as Session;

afterEach(cleanup);

it.each([
  [1.214, [5.04, 78.46], "1.21", "5.0\u00a0to\u00a078.5"],
  [-0.996, [-7.25, 70.5], "1.00", "−7.3\u00a0to\u00a070.5"],
  [0.049, [-0.04, 90], "0.05", "0.0\u00a0to\u00a090.0"],
] as [number, [number, number], string, string][])(
  "the error %s and the range %s",
  async (peak, range, error, reached) => {
    const shown = session(peak, range);
    render(
      <MantineProvider env="test">
        <TestRouter>
          <ResultMetrics session={shown} />
          <RunNumbers run={shown.runs[0] as Run} number={1} />
        </TestRouter>
      </MantineProvider>,
    );
    expect((await screen.findByTestId("result-worst")).textContent).toContain(`${error}°`);
    expect(screen.getByTestId("result-range").textContent).toContain(`${reached}°`);
    expect(screen.getByTestId("errors").textContent).toContain(error);
    expect(screen.getByTestId("motions").textContent).toContain(reached);
    const cells = compareSessions(shown, shown)[1]?.lines.map(({ here }) => here);
    expect(cells).toContain(error);
    expect(cells).toContain(reached);
  },
);
