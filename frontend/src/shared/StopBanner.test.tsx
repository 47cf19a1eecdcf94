import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { ME } from "../access/examples";
import { access } from "../access/standing";
import type { Live } from "../api/client";
import { type LiveState, store } from "../live/store";
import { StopBanner } from "./StopBanner";

const cause = {
  code: "load_repeated",
  category: 2 as const,
  message: "Motor 4 met resistance twice in the same place.",
  next_step: "The arm is held: support it, then acknowledge.",
  axis: 4,
  cleared: true,
};

function show(arm_held: boolean, connected = true) {
  const live = { device: "running", age_ms: 5, mode: "stopped", refusals: {} } as Partial<Live>;
  const stop = { causes: [cause], arm_held };
  const state = { connected, heardAt: 0, station: null, live: { kept: {}, ...live, stop }, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  render(
    <MantineProvider>
      <QueryClientProvider client={new QueryClient()}>
        <StopBanner />
      </QueryClientProvider>
    </MantineProvider>,
  );
  return screen.getByTestId("stop-banner").textContent ?? "";
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("a stop", () => {
  it("that holds the arm says so, and that acknowledging lets it go", () => {
    const told = show(true);
    expect(told).toContain("The motors still hold the arm");
    expect(told).toContain("Acknowledge and let the arm go");
    expect(told).toContain("Support the arm first");
    expect(told).not.toContain("This has cleared");
  });

  it("without torque says nothing of holding", () => {
    const told = show(false);
    expect(told).not.toContain("hold the arm");
    expect(told).toContain("This has cleared");
    expect(screen.getByRole("button").textContent).toBe("Acknowledge");
  });

  it("is acknowledged by whoever operates, and by nobody behind a locked screen", () => {
    access.came({ ...ME, locked: true });
    expect(show(false)).toContain("acknowledges it, signed in and with the screen unlocked");
    expect(screen.queryByRole("button")).toBeNull();
  });

  it("of which nothing is heard any more promises no hold", () => {
    expect(show(true, false)).not.toContain("motors still hold");
  });
});
