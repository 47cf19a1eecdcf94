import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, within } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { withoutJoiners } from "../../lib/joinUnits";
import { SessionComparison } from "./SessionComparison";

const at = (day: number) => `2026-11-0${day}T09:00:00Z`;
const summary = (id: string, day: number) => ({ id, started_at: at(day) }) as Schemas["SessionSummary"];
const session = (id: string, day: number, pain_before: number, of: Partial<Session> = {}) =>
  ({
    id,
    patient: { id: "p" },
    side: "left",
    simulated: false,
    started_at: at(day),
    runs: [],
    pain_before,
    pain_during: null,
    pain_after: null,
    ...of,
  }) as unknown as Session;

const list = vi.spyOn(api, "patientSessions");
beforeEach(() => {
  vi.resetAllMocks();
  vi.spyOn(api, "session").mockImplementation(async (id) => session(id, id === "old" ? 1 : 2, 7));
});
afterEach(cleanup);

function show(of: Partial<Session> = {}) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        <SessionComparison session={session("here", 3, 4, of)} />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

async function choose(day: number) {
  fireEvent.click(await screen.findByRole("combobox", { name: "Session" }));
  fireEvent.click(await screen.findByText(withoutJoiners(formatMoment(at(day)))));
}

it("compares the session with the chosen one", async () => {
  list.mockResolvedValue({ items: [summary("here", 3), summary("second", 2)], next: null });
  show();
  await choose(2);
  const table = await screen.findByTestId("beside");
  expect(within(table).getByRole("row", { name: "Before 7 4 −3" })).toBeTruthy();
  expect(screen.queryByText("Older sessions")).toBeNull();
});

it("offers old sessions too", async () => {
  list.mockImplementation(async (_, after) =>
    after ? { items: [summary("old", 1)], next: null } : { items: [summary("second", 2)], next: "further" },
  );
  show();
  fireEvent.click(await screen.findByText("Older sessions"));
  await choose(1);
  expect(await screen.findByTestId("beside")).toBeTruthy();
  expect(api.session).toHaveBeenCalledWith("old");
});

it("is hidden for the patient's only session", async () => {
  list.mockResolvedValue({ items: [summary("here", 3)], next: null });
  show();
  await vi.waitFor(() => expect(list).toHaveBeenCalled());
  expect(screen.queryByText("Compare with another session")).toBeNull();
});

it("names shoulder and simulation of both sessions, and the caveat of slip", async () => {
  list.mockResolvedValue({ items: [summary("second", 2)], next: null });
  show({ simulated: true });
  await choose(2);
  const [, other, here] = within(await screen.findByTestId("beside")).getAllByRole("columnheader");
  expect(other?.textContent).toMatch(/Left shoulder$/);
  expect(here?.textContent).toMatch(/Left shoulder, Simulated apparatus$/);
  expect(screen.getByText(/the arm can slip in its cuff/)).toBeTruthy();
  expect(screen.queryByText(/different shoulders/)).toBeNull();
});

it("shows no change between different shoulders", async () => {
  list.mockResolvedValue({ items: [summary("second", 2)], next: null });
  show({ side: "right" });
  await choose(2);
  const table = await screen.findByTestId("beside");
  expect(within(table).getByRole("row", { name: "Before 7 4" })).toBeTruthy();
  expect(
    screen.getByText("The sessions treated different shoulders. The differences are no change."),
  ).toBeTruthy();
});
