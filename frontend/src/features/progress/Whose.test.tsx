import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { createMemoryHistory, createRootRoute, createRouter, RouterProvider } from "@tanstack/react-router";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type Episode, type Patient } from "../../lib/api/client";
import { Whose } from "./ProgressPage";

const episodes = vi.spyOn(api, "episodes");

function show(episodeId: string) {
  const queries = new QueryClient();
  const routeTree = createRootRoute({ component: () => <Whose patientId="p1" episodeId={episodeId} /> });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={queries}>
        <RouterProvider router={createRouter({ routeTree, history: createMemoryHistory() })} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  return queries;
}

beforeEach(() => {
  vi.spyOn(api, "patient").mockResolvedValue({ id: "p1", name: "Ishii Nao" } as Patient);
  episodes.mockResolvedValue({ items: [{ id: "e1", side: "right" } as Episode], next: null });
});
afterEach(cleanup);

describe("an episode's progress", () => {
  it("shows the patient and the shoulder", async () => {
    show("e1");
    expect((await screen.findByRole("link", { name: "Ishii Nao" })).getAttribute("href")).toBe(
      "/patients/p1",
    );
    screen.getByText("Right shoulder");
  });

  it("shows no name for another patient's episode", async () => {
    const queries = show("e2");
    await vi.waitFor(() => {
      expect(queries.getQueryData(["patient", "p1"])).toBeDefined();
      expect(queries.getQueryData(["episodes", "p1"])).toBeDefined();
    });
    expect(screen.queryByText("Ishii Nao")).toBeNull();
  });
});
