import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen, within } from "@testing-library/react";
import { afterEach, beforeEach, expect, it } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import type { Schemas } from "../../lib/api/client";
import { SessionTable } from "./SessionTable";

const session = (id: string, ended_at: string | null) =>
  ({
    id,
    patient: { id: "p", name: `Patient ${id}`, clinic_number: id },
    started_at: "2026-11-21T09:30:00Z",
    ended_at,
    signed_at: null,
    therapist: "Aoki",
    station: "Station 1",
    simulated: false,
    runs: 2,
    stops: 0,
  }) as Schemas["SessionSummary"];

beforeEach(() => localStorage.clear());
afterEach(cleanup);

it.each([true, false])("a row says that its session is still open (with patient: %s)", (withPatient) => {
  // A telephone hides the end of a session until the user chooses it.
  localStorage.setItem("kata.columns.sessions", JSON.stringify(["ended"]));
  render(
    <MantineProvider>
      <TestRouter>
        <SessionTable
          items={[session("1", null), session("2", "2026-11-21T10:00:00Z")]}
          withPatient={withPatient}
          more={false}
          fetchAll={async () => ({ rows: [], complete: true })}
        />
      </TestRouter>
    </MantineProvider>,
  );
  const [, open, ended] = screen.getAllByRole("row");
  expect(within(open as HTMLElement).getAllByText("Still open")).toHaveLength(1);
  expect(within(ended as HTMLElement).queryByText("Still open")).toBeNull();
});
