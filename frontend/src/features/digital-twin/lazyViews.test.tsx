import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../../lib/api/client";
import { type LiveState, store } from "../../lib/live/store";
import { LiveApparatus } from "./lazyViews";

function opener(torque: Live["torque"]) {
  const state = {
    connected: true,
    heardAt: 0,
    station: null,
    live: { torque } as Partial<Live>,
    events: [],
  };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  render(
    <MantineProvider>
      <LiveApparatus />
    </MantineProvider>,
  );
  return screen.getByRole("button", { name: "Show in 3D" }) as HTMLButtonElement;
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("the apparatus in three dimensions", () => {
  it("opens only without torque, because drawing may delay Stop", () => {
    expect(opener("on").disabled).toBe(true);
    expect(screen.getByText("Available when the motors have no torque.")).toBeTruthy();
    cleanup();
    expect(opener("unknown").disabled).toBe(true);
    cleanup();
    expect(opener("off").disabled).toBe(false);
  });
});
