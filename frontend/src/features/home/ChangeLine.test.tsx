import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Schemas } from "../../lib/api/client";
import { FORM } from "../assessments/examples";
import { ChangeLine } from "./ChangeLine";

afterEach(cleanup);

function show(measure: "spadi" | "pain", before: number, now: number) {
  vi.spyOn(api, "assessmentForm").mockResolvedValue(FORM);
  const patient: Schemas["SessionPatient"] = { id: "p", name: "Mori Rin", clinic_number: "1" };
  const at = "2026-11-20T09:30:00Z";
  const times = { last_session_at: at, assessed_at: at };
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>
          <ChangeLine change={{ patient, ...times, side: "left", measure, before, now }} />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
  return screen.findByRole("listitem");
}

it.each([
  ["spadi", 60, 40, "(−20)", "Better, beyond the measurement error"],
  ["spadi", 54, 40, "(−14)", "Perhaps better, but within the measurement error"],
  ["spadi", 54, 50, "(−4)", "No important change (below the MCID)"],
  ["spadi", 40, 54, "(+14)", "Perhaps worse, but within the measurement error"],
  ["spadi", 40, 60, "(+20)", "Worse, beyond the measurement error"],
  ["pain", 5, 3, "(−2)", "Less pain"],
  ["pain", 3, 5, "(+2)", "More pain"],
] as const)(
  "a change of the %s from %s to %s says what it means",
  async (measure, before, now, shown, means) => {
    const line = await show(measure, before, now);
    expect(await screen.findByText(means)).toBeTruthy();
    expect(line.textContent).toContain(shown);
  },
);

it("no change has no meaning", async () => {
  expect((await show("spadi", 40, 40)).textContent).toMatch(/\(unchanged\)$/);
});
