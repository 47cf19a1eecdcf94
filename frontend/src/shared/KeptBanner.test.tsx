import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import type { Live } from "../api/client";
import { type LiveState, store } from "../live/store";
import { formatClock } from "./format";
import { KeptBanner } from "./KeptBanner";

const SINCE = "2026-11-22T05:00:07Z";

function show(kept: Partial<Live["kept"]>, connected = true) {
  const told = { away_since: null, waiting: 0, not_kept_since: null, ...kept };
  const state = { connected, heardAt: 0, station: null, live: { kept: told }, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  render(
    <MantineProvider>
      <KeptBanner />
    </MantineProvider>,
  );
  return screen.queryByTestId("kept");
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("while the database does not answer, the page", () => {
  it("says since when, that nothing is lost, and what has to wait", () => {
    const told = show({ away_since: SINCE, waiting: 3 })?.textContent ?? "";
    expect(told).toContain(`does not answer since ${formatClock(new Date(SINCE))}`);
    expect(told).toContain("Nothing is lost");
    expect(told).toContain("Stop works");
    expect(told).toContain("signing in, records and beginning something have to wait");
  });

  it("says nothing while it does, nor what nobody has heard", () => {
    expect(show({})).toBeNull();
    cleanup();
    expect(show({ away_since: SINCE }, false)).toBeNull();
  });

  it("promises nothing once the disk is full", () => {
    const banner = show({ away_since: SINCE, not_kept_since: SINCE });
    expect(banner?.textContent).toContain("disk takes nothing");
    expect(banner?.textContent).not.toContain("Nothing is lost");
    expect(banner?.getAttribute("role")).toBe("alert");
  });
});
