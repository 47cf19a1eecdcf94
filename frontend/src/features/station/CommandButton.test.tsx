import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { ProblemError } from "../../lib/api/client";
import { type LiveState, store } from "../../lib/live/store";
import { HOLD_MS } from "../../safety/useHold";
import { CommandButton } from "./CommandButton";

const client = new QueryClient();

function shown(refusals: object, send: () => Promise<unknown>, held = false) {
  const live = { device: "running", age_ms: 5, mode: "paused", refusals };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  return (
    <MantineProvider env="test">
      <QueryClientProvider client={client}>
        <CommandButton command="play" send={send} held={held}>
          Play
        </CommandButton>
      </QueryClientProvider>
    </MantineProvider>
  );
}

function show(refusals: object, send: () => Promise<unknown>) {
  render(shown(refusals, send));
  return screen.getByRole("button");
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

it("is disabled until the command is confirmed and shown", async () => {
  let confirmed = () => {};
  let fresh = () => {};
  vi.spyOn(store, "waitForFreshState").mockReturnValue(new Promise((resolve) => (fresh = resolve)));
  const send = vi.fn(() => new Promise<void>((resolve) => (confirmed = resolve)));
  const button = show({}, send);
  fireEvent.click(button);
  await waitFor(() => expect(button.hasAttribute("disabled")).toBe(true));
  expect(screen.getByText(/Waiting for the apparatus/)).toBeTruthy();
  await act(async () => confirmed());
  fireEvent.click(button);
  expect(button.hasAttribute("disabled")).toBe(true);
  expect(send).toHaveBeenCalledTimes(1);
  await act(async () => fresh());
  await waitFor(() => expect(button.hasAttribute("disabled")).toBe(false));
});

it("explains beside the button why a command is impossible", () => {
  const refusal = { code: "is_idle", message: "No recording is loaded.", next_step: "Load one first." };
  const button = show({ play: refusal }, vi.fn());
  expect(button.hasAttribute("disabled")).toBe(true);
  const about = document.getElementById(button.getAttribute("aria-describedby") ?? "");
  expect(about?.textContent).toBe("No recording is loaded. Load one first.");
});

it("shows the reason for a refused value beside the button", async () => {
  const errors = [
    {
      pointer: "#/largest_deg",
      field: "largest",
      detail: "must be 190 or less",
      field_key: null,
      detail_key: null,
    },
  ];
  const problem = new ProblemError({ detail: "Please check: largest angle must be 190 or less.", errors });
  fireEvent.click(show({}, () => Promise.reject(problem)));
  expect(await screen.findByText(/largest angle must be 190 or less/)).toBeTruthy();
});

describe("a button that needs a hold", () => {
  const send = vi.fn(() => Promise.resolve());
  const wait = (ms: number) => act(() => vi.advanceTimersByTimeAsync(ms));
  const possible = () => shown({}, send, true);
  const impossible = () => shown({ play: { code: "x", message: "Not now.", next_step: "" } }, send, true);
  const button = () => screen.getByRole("button");

  beforeEach(() => {
    vi.useFakeTimers();
    send.mockClear();
  });
  afterEach(() => vi.useRealTimers());

  const press = () => {
    vi.spyOn(button(), "getBoundingClientRect").mockReturnValue(new DOMRect(100, 100, 200, 60));
    fireEvent.pointerDown(button(), { button: 0, buttons: 1, pointerId: 7, clientX: 290, clientY: 130 });
  };
  const move = (clientX: number, buttons = 1) =>
    fireEvent.pointerMove(button(), { buttons, pointerId: 7, clientX, clientY: 130 });

  it.each([
    ["pointer", press, () => fireEvent.pointerUp(button())],
    ["pointer released elsewhere", press, () => fireEvent.pointerUp(document.body)],
    ["second finger", press, () => fireEvent.pointerUp(document.body, { pointerId: 8 })],
    ["cancelled pointer", press, () => fireEvent.pointerCancel(document.body)],
    ["pointer that slides off", press, () => move(340)],
    ["pointer that leaves without capture", press, () => fireEvent.pointerOut(button())],
    ["pointer whose capture ends", press, () => fireEvent.lostPointerCapture(button())],
    ["primary button released before another one", press, () => move(290, 2)],
    ["pointer while the window loses the focus", press, () => fireEvent.blur(window)],
    ["pointer while the page is hidden", press, () => fireEvent(document, new Event("visibilitychange"))],
    [
      "Enter",
      () => fireEvent.keyDown(button(), { key: "Enter" }),
      () => fireEvent.keyUp(button(), { key: "Enter" }),
    ],
    [
      "space bar",
      () => fireEvent.keyDown(button(), { key: " " }),
      () => fireEvent.keyUp(button(), { key: " " }),
    ],
    [
      "key whose window goes away",
      () => fireEvent.keyDown(button(), { key: " " }),
      () => fireEvent.blur(button()),
    ],
  ])("reacts to a %s only after one second", async (_, down, up) => {
    render(possible());
    down();
    await wait(HOLD_MS - 1);
    up();
    fireEvent.click(button(), { detail: 1 });
    await wait(2 * HOLD_MS);
    expect(send).not.toHaveBeenCalled();
    down();
    await wait(HOLD_MS + 1);
    expect(send).toHaveBeenCalledTimes(1);
    up();
    await wait(2 * HOLD_MS);
    expect(send).toHaveBeenCalledTimes(1);
  });

  it("keeps the hold of a captured pointer although the button moves", async () => {
    const captured = vi.spyOn(HTMLElement.prototype, "setPointerCapture");
    render(possible());
    press();
    expect(captured).toHaveBeenCalledWith(7);
    // A text above the button appears. The browser then reports the resting pointer, and a hand trembles.
    vi.spyOn(button(), "getBoundingClientRect").mockReturnValue(new DOMRect(100, 300, 200, 60));
    move(290);
    await wait(HOLD_MS / 2);
    move(305);
    await wait(HOLD_MS / 2 + 1);
    expect(send).toHaveBeenCalledTimes(1);
  });

  it("ignores repeated keys and other keys", async () => {
    render(possible());
    fireEvent.keyDown(button(), { key: "Enter" });
    await wait(HOLD_MS / 2);
    fireEvent.keyDown(button(), { key: "Enter", repeat: true });
    await wait(HOLD_MS / 2 + 1);
    expect(send).toHaveBeenCalledTimes(1);
    fireEvent.keyDown(button(), { key: "a" });
    await wait(HOLD_MS);
    expect(send).toHaveBeenCalledTimes(1);
  });

  it("ignores a hold that ended while the page hung", async () => {
    render(possible());
    press();
    await wait(HOLD_MS);
    fireEvent.pointerUp(button());
    await wait(HOLD_MS);
    expect(send).not.toHaveBeenCalled();
  });

  it("does nothing if the command becomes impossible during the hold", async () => {
    const { rerender } = render(possible());
    press();
    await wait(HOLD_MS / 2);
    rerender(impossible());
    await wait(HOLD_MS);
    rerender(possible());
    await wait(HOLD_MS);
    expect(send).not.toHaveBeenCalled();
  });

  it("accepts a second press from voice or switch control", async () => {
    render(possible());
    fireEvent.click(button(), { detail: 0 });
    expect(screen.getByText(/Press again/)).toBeTruthy();
    await wait(6000);
    expect(screen.queryByText(/Press again/)).toBeNull();
    fireEvent.click(button(), { detail: 0 });
    expect(send).not.toHaveBeenCalled();
    fireEvent.click(button(), { detail: 0 });
    await wait(0);
    expect(send).toHaveBeenCalledTimes(1);
  });
});
