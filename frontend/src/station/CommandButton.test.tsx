import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { type LiveState, store } from "../live/store";
import { CommandButton } from "./CommandButton";

function show(refusals: object, send: () => Promise<unknown>) {
  const live = { device: "running", age_ms: 5, mode: "paused", refusals };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <CommandButton command="play" send={send}>
          Play
        </CommandButton>
      </QueryClientProvider>
    </MantineProvider>,
  );
  return screen.getByRole("button");
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

it("is disabled, saying why, until the apparatus has confirmed a command and the page shows it", async () => {
  let confirmed = () => {};
  let shown = () => {};
  vi.spyOn(store, "told").mockReturnValue(new Promise((resolve) => (shown = resolve)));
  const send = vi.fn(() => new Promise<void>((resolve) => (confirmed = resolve)));
  const button = show({}, send);
  fireEvent.click(button);
  await waitFor(() => expect(button.hasAttribute("disabled")).toBe(true));
  expect(screen.getByText(/waits for the apparatus/)).toBeTruthy();
  await act(async () => confirmed());
  fireEvent.click(button);
  expect(button.hasAttribute("disabled")).toBe(true);
  expect(send).toHaveBeenCalledTimes(1);
  await act(async () => shown());
  await waitFor(() => expect(button.hasAttribute("disabled")).toBe(false));
});

it("says beside the button, for touch and for screen readers, why a command is not possible", () => {
  const refusal = { code: "is_idle", message: "No recording is loaded.", next_step: "Load one first." };
  const button = show({ play: refusal }, vi.fn());
  expect(button.hasAttribute("disabled")).toBe(true);
  const about = document.getElementById(button.getAttribute("aria-describedby") ?? "");
  expect(about?.textContent).toBe("No recording is loaded. Load one first.");
});
