import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { Tracking } from "./Tracking";

afterEach(cleanup);

type Quality = Awaited<ReturnType<typeof api.trackingQuality>>;

function show(quality: Quality) {
  vi.spyOn(api, "trackingQuality").mockResolvedValue(quality);
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <Tracking search={{}} />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

async function shown(left_out: number) {
  show({ rows: [], drift: [], left_out });
  await screen.findByText("There is no data in this period.");
  return document.body.textContent;
}

it("the page says how many partial playbacks are left out", async () => {
  expect(await shown(3)).toMatch(/3\s+playbacks in this period are left out/);
});

it("the page says nothing about partial playbacks without one", async () => {
  expect(await shown(0)).not.toMatch(/left out/);
});

it("a station's change is the difference of the shown numbers", async () => {
  const change_deg = { value: -0.0249, low: -0.09, high: 0.05 };
  const station = { station: "Station 2", playbacks: 27, before_deg: 0.7051, rmse_deg: 0.6802, change_deg };
  const week = { station: "Station 2", begins_on: "2026-11-23", playbacks: 3, rmse_deg: 0.7, peak_deg: 1 };
  show({ rows: [week], drift: [{ ...station, drifting: false }], left_out: 0 });
  const [head, row] = await screen.findAllByRole("row");
  expect(head?.textContent).toContain("Playbacks, last four weeks");
  expect(row?.textContent).toContain("0.710.68−0.03 (−0.09\u00a0to\u00a00.05)27");
});
