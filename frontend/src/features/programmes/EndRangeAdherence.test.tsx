import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import type { Schemas } from "../../lib/api/client";
import { EndRangeAdherence } from "./EndRangeAdherence";

afterEach(cleanup);

const done = (counted_s: number | null, prescribed_s: number | null) => ({
  motion: 4,
  name: "Abduction / adduction of the shoulder",
  name_key: { code: "motion_4", params: {} },
  counted_s,
  prescribed_s,
});
const week = (begins_on: string, given: Partial<Schemas["AdherenceWeek"]>): Schemas["AdherenceWeek"] => ({
  begins_on,
  sessions: 1,
  sessions_prescribed: 3,
  repetitions_planned: 0,
  repetitions_done: 0,
  end_range: [],
  end_range_sessions: [],
  ...given,
});

it("compares this week's time with the prescription and lists sessions", () => {
  const session = { session_id: "s", started_at: "2026-11-17T09:30:00Z", motions: [done(null, 300)] };
  render(
    <MantineProvider>
      <TestRouter>
        <EndRangeAdherence
          weeks={[
            week("2026-11-09", { end_range: [done(60, null)] }),
            week("2026-11-16", { end_range: [done(125.9, 900)], end_range_sessions: [session] }),
          ]}
        />
      </TestRouter>
    </MantineProvider>,
  );
  expect(screen.getByTestId("end-range").textContent).toContain("2\u00a0min 5\u00a0s of 15\u00a0min");
  fireEvent.click(screen.getByRole("button", { expanded: false }));
  const rows = screen.getAllByRole("row").map((row) => row.textContent);
  expect(rows).toHaveLength(4);
  expect(rows[1]).toContain("2\u00a0min 5\u00a0s15\u00a0min");
  expect(rows[2]).toContain("–5\u00a0min");
  expect(rows[3]).toContain("1\u00a0min–");
});

it("is not shown where no end-range time is prescribed or counted", () => {
  const { container } = render(
    <MantineProvider>
      <EndRangeAdherence weeks={[week("2026-11-16", {})]} />
    </MantineProvider>,
  );
  expect(container.querySelector("[data-testid]")).toBeNull();
});
