import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Schemas } from "../../lib/api/client";
import { readSearch, spanOf } from "../statistics/figuresSearch";
import { BackupTile, StopsTile, TrackingTile, UnsignedTile, UsageTile } from "./managementTiles";
import { AdherenceTile, ImprovedTile } from "./outcomeTiles";

const GOOD = { at: "2026-11-20T02:00:00Z", failure: "" };

async function textOfTile(newest: Pick<Schemas["Backup"], "at" | "failure">) {
  vi.spyOn(api, "backups").mockResolvedValue({ items: [newest], last_good: GOOD, next_at: null } as never);
  show(BackupTile);
  return (await screen.findByRole("link", { name: /2026/ })).textContent;
}

function show(Tile: () => ReactNode) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter>
          <Tile />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
}

afterEach(() => {
  cleanup();
  vi.useRealTimers();
});

it("the tile says when the newest backup or its test restore failed", async () => {
  expect(await textOfTile({ at: "2026-11-21T02:00:00Z", failure: "A table is missing." })).toMatch(/failed/);
});

it("the tile is quiet after a good backup", async () => {
  expect(await textOfTile(GOOD)).not.toMatch(/failed/);
});

it("the tile of unsigned notes leads to their sessions", async () => {
  vi.spyOn(api, "worklist").mockResolvedValue({ unsigned_count: 3 } as never);
  show(UnsignedTile);
  const tile = await screen.findByRole("link", { name: /Unsigned notes.*3/ });
  expect(tile.getAttribute("href")).toBe("/sessions?note=unsigned");
});

it("the tile of adherence leads to the patients behind its figure", async () => {
  const days = { first_day: "2026-11-03", last_day: "2026-11-30" };
  const adherence = { ...days, programmes: 12, overdue: 2, prescribed: 80, held: 60 };
  vi.spyOn(api, "clinicAdherence").mockResolvedValue({ adherence, least_programmes: 10 });
  show(AdherenceTile);
  const tile = await screen.findByRole("link", { name: /75\u00a0%/ });
  expect(tile.getAttribute("href")).toBe("/clinic/adherence");
  expect(tile.textContent).toContain(
    "Nov\u00a03\u00a0to\u00a0Nov\u00a030,\u00a02026. 60\u00a0of\u00a080 sessions",
  );
});

it("the tile of stops says which days it asks for, as the tile of adherence does", async () => {
  vi.useFakeTimers({ now: Date.parse("2026-11-30T05:00:00Z"), toFake: ["Date"] });
  const counted = vi.spyOn(api, "stopCounts");
  counted.mockResolvedValue({ rows: [], sessions: 5, stopped_sessions: 0 } as never);
  show(StopsTile);
  const tile = await screen.findByRole("link", { name: /0\u00a0of\u00a05/ });
  expect(tile.textContent).toContain("Nov\u00a03\u00a0to\u00a0Nov\u00a030,\u00a02026. No stop");
  expect(counted).toHaveBeenCalledWith({
    since: "2026-11-03T00:00:00.000Z",
    until: "2026-12-01T00:00:00.000Z",
  });
});

it("the tile of stops counts a session with two causes once, and adds up the stations", async () => {
  const row = (code: string, station: string, sessions: number, alarms = sessions) => ({
    code,
    station,
    sessions,
    alarms,
  });
  const rows = [
    row("operator_stop", "A", 3),
    row("estop_pressed", "A", 2),
    row("estop_pressed", "B", 2),
    row("bus_lost", "A", 0, 9),
  ];
  vi.spyOn(api, "stopCounts").mockResolvedValue({ rows, sessions: 5, stopped_sessions: 5 } as never);
  show(StopsTile);
  const tile = await screen.findByRole("link", { name: /5\u00a0of\u00a05/ });
  expect(tile.textContent).toMatch(/Most frequent: .*emergency stop/i);
});

const EMPTY = { rows: [], drift: [], groups: [], sessions: 0, stopped_sessions: 0, least_patients: 10 };

it.each([
  ["outcomes", "Shoulders improved by at least the MCID in 12 months", ImprovedTile],
  ["usage", "7 days", UsageTile],
  ["stops", "4 weeks", StopsTile],
  ["trackingQuality", "Last four weeks", TrackingTile],
] as const)("the tile of %s asks for the period of the page behind it: %s", async (call, words, Tile) => {
  vi.useFakeTimers({ now: Date.parse("2026-11-30T05:00:00Z"), toFake: ["Date"] });
  const asked = vi.spyOn(api, call === "stops" ? "stopCounts" : call).mockResolvedValue(EMPTY as never);
  show(Tile);
  const tile = await screen.findByRole("link");
  expect(tile.textContent).toContain(words);
  const address = new URL(tile.getAttribute("href") ?? "", "http://kata");
  const search = readSearch(Object.fromEntries(address.searchParams));
  expect(asked.mock.calls[0]?.[0]).toEqual(spanOf(search, new Date()));
});

it("hidden tiles name what they count too few of", async () => {
  vi.spyOn(api, "clinicAdherence").mockResolvedValue({ adherence: null, least_programmes: 10 });
  show(AdherenceTile);
  expect((await screen.findByRole("link", { name: /Hidden/ })).textContent).toContain(
    "Fewer than 10 programmes",
  );
  cleanup();
  vi.spyOn(api, "outcomes").mockResolvedValue({ groups: [], limits: {}, least_patients: 10 } as never);
  show(ImprovedTile);
  expect((await screen.findByRole("link", { name: /Hidden/ })).textContent).toContain(
    "Shoulders of fewer than 10 patients",
  );
});
