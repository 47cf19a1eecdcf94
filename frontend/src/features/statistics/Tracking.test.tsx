import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { Tracking } from "./Tracking";

afterEach(cleanup);

async function shown(left_out: number) {
  vi.spyOn(api, "trackingQuality").mockResolvedValue({ rows: [], drift: [], left_out });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <Tracking search={{}} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  await screen.findByText("There is no data in this period.");
  return document.body.textContent;
}

it("the page says how many partial playbacks are left out", async () => {
  expect(await shown(3)).toMatch(/3\s+playbacks in this period are left out/);
});

it("the page says nothing about partial playbacks without one", async () => {
  expect(await shown(0)).not.toMatch(/left out/);
});
