import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { RunFigures } from "./RunFigures";

afterEach(cleanup);

it("offers the wall clock and states its offset", async () => {
  const asked = vi.spyOn(api, "runFigures").mockResolvedValue({ motors: [] });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <RunFigures runId="run" worstMotor={3} clockOffset_s={0.094} length_s={null} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  await vi.waitFor(() => expect(asked).toHaveBeenLastCalledWith("run", null, "path"));
  expect(screen.getByText("Real time is ahead of motion time by up to 0.094 s.")).toBeTruthy();
  fireEvent.click(screen.getByRole("radio", { name: "Real time" }));
  await vi.waitFor(() => expect(asked).toHaveBeenLastCalledWith("run", null, "wall"));
});

it("shows the motor with the largest error first, another one or all on request", async () => {
  const figure = { data: [], layout: {}, texts: [] };
  vi.spyOn(api, "runFigures").mockResolvedValue({
    motors: [1, 2, 3, 4, 5].map((motor) => ({ motor, figure })),
  });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <RunFigures runId="run" worstMotor={3} clockOffset_s={null} length_s={null} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  const shown = () =>
    screen.queryAllByRole("figure").map((plot) => plot.getAttribute("aria-label")?.slice(0, 8));
  await vi.waitFor(() => expect(shown()).toEqual(["Motor\u00a03:"]));
  fireEvent.click(screen.getByRole("radio", { name: "Motor\u00a05" }));
  expect(shown()).toEqual(["Motor\u00a05:"]);
  fireEvent.click(screen.getByRole("radio", { name: "All motors" }));
  expect(shown()).toEqual([
    "Motor\u00a01:",
    "Motor\u00a02:",
    "Motor\u00a03:",
    "Motor\u00a04:",
    "Motor\u00a05:",
  ]);
});
