import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, render, screen, waitFor } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../../lib/api/client";
import { type LiveState, store } from "../../lib/live/store";
import { LiveApparatus } from "./lazyViews";

const drawn = () => screen.queryByRole("radiogroup", { name: "View" });

let state: LiveState;
const listeners = new Set<() => void>();

function setTorque(torque: Live["torque"]) {
  state = {
    connected: true,
    heardAt: 0,
    station: { axes: [] },
    live: { torque, side: "right", mode: "idle" } as Partial<Live>,
    events: [],
  } as unknown as LiveState;
  for (const listener of listeners) listener();
}

function show(torque: Live["torque"]) {
  setTorque(torque);
  vi.spyOn(store, "get").mockImplementation(() => state);
  vi.spyOn(store, "subscribe").mockImplementation((listener) => {
    listeners.add(listener);
    return () => listeners.delete(listener);
  });
  render(
    <MantineProvider>
      <QueryClientProvider client={new QueryClient()}>
        <LiveApparatus />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("the apparatus in three dimensions", () => {
  it.each(["on", "unknown"] as const)(
    "does not begin with torque %s, because drawing may delay Stop",
    async (torque) => {
      show(torque);
      await act(() => new Promise((done) => setTimeout(done)));
      expect(screen.getByText("Available when the motors have no torque.")).toBeTruthy();
      expect(drawn()).toBeNull();
    },
  );

  it("begins without torque, and stays", async () => {
    show("off");
    await waitFor(() => expect(drawn()).toBeTruthy());
    act(() => setTorque("on"));
    expect(drawn()).toBeTruthy();
  });
});
