import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { authStore } from "../features/auth/authState";
import { ME } from "../features/auth/testUsers";
import { api, type Live } from "../lib/api/client";
import { type LiveState, store } from "../lib/live/store";
import { StopBanner } from "./StopBanner";
import { HOLD_MS } from "./useHold";

const cause = {
  code: "load_repeated",
  category: 2 as const,
  message: "Motor 4 met resistance twice at the same place.",
  next_step: "The arm is held: support it, then acknowledge.",
  axis: 4,
  cleared: true,
};

const NOTHING_FOUND = {
  code: "no_torque_found",
  message: "No motor had torque when the apparatus was connected.",
  next_step: "",
};

type Options = {
  arm_held: boolean;
  torque?: Live["torque"];
  connected?: boolean;
  torqueFound?: boolean;
  causes?: (typeof cause)[];
  refusal?: typeof NOTHING_FOUND;
};

function withState(options: Options) {
  const { arm_held, torque = "off", connected = true, torqueFound = false } = options;
  const { causes = [cause], refusal } = options;
  const refusals: Partial<Live["refusals"]> = {
    ...(!torqueFound && { release_torque: NOTHING_FOUND }),
    ...(refusal && { acknowledge: refusal }),
  };
  const live = {
    device: "running",
    age_ms: 5,
    mode: "stopped",
    torque,
    refusals,
    warnings: [],
  } as Partial<Live>;
  const stop = { causes, arm_held };
  const state = { connected, heardAt: 0, station: null, live: { database: {}, ...live, stop }, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  return (
    <MantineProvider>
      <QueryClientProvider client={new QueryClient()}>
        <StopBanner fullPage={false} />
      </QueryClientProvider>
    </MantineProvider>
  );
}

function show(options: Options) {
  render(withState(options));
  return screen.getByTestId("stop-banner").textContent ?? "";
}

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("a stop", () => {
  it("that holds the arm announces that acknowledging releases it", () => {
    const text = show({ arm_held: true, torque: "on" });
    expect(text).toContain("The motors still hold the arm");
    expect(text).toContain("Acknowledge and release the arm");
    expect(text).toContain("Support the arm first");
    expect(text).not.toContain("The cause has cleared");
  });

  it("without torque does not mention holding", () => {
    const text = show({ arm_held: false });
    expect(text).not.toContain("hold the arm");
    expect(text).toContain("The cause has cleared");
    expect(screen.getByRole("button").textContent).toBe("Acknowledge");
  });

  it("cannot be acknowledged behind a locked screen", () => {
    authStore.signedIn({ ...ME, locked: true });
    expect(show({ arm_held: false })).toContain(
      "can acknowledge the stop, signed in and with the screen unlocked",
    );
    expect(screen.queryByRole("button")).toBeNull();
  });

  it("without a connection promises no hold", () => {
    const text = show({ arm_held: true, torque: "on", connected: false });
    expect(text).not.toContain("motors still hold");
    expect(text).not.toContain("has been stopped");
    expect(text).toContain("It is unknown whether the motors hold the arm");
    expect(text).toContain("Support the arm");
    // The causes may be old, so they are grey. The instruction is not old.
    const greyed = (words: RegExp) => screen.getByText(words).closest("li")?.style.color ?? "";
    expect(greyed(/met resistance/)).toContain("dimmed");
    expect(greyed(/Grey values are old/)).toBe("");
    expect(document.querySelector(".stale")).toBeNull();
  });

  it("comes into view at its beginning and at a new cause only", () => {
    const scroll = vi.spyOn(HTMLElement.prototype, "scrollIntoView");
    const { rerender } = render(withState({ arm_held: false }));
    rerender(withState({ arm_held: false }));
    expect(scroll).toHaveBeenCalledTimes(1);
    rerender(withState({ arm_held: false, causes: [cause, { ...cause, code: "estop_pressed" }] }));
    expect(scroll).toHaveBeenCalledTimes(2);
  });

  it("with unknown torque warns that motors may hold the arm", () => {
    expect(show({ arm_held: true, torque: "unknown" })).toContain("The motors may still hold the arm");
  });

  it("releases an arm found held only by a hold", () => {
    const release = vi.spyOn(api, "releaseTorque").mockResolvedValue({ accepted: true });
    show({ arm_held: true, torque: "on", torqueFound: true });
    const button = screen.getByRole("button", { name: "Release torque" });
    fireEvent.pointerDown(button, { button: 0 });
    fireEvent.pointerUp(button);
    expect(release).not.toHaveBeenCalled();
  });
});

describe("a stop that cannot be acknowledged yet", () => {
  const pressed = {
    ...cause,
    code: "estop_pressed",
    message: "The emergency stop was pressed.",
    next_step: "Release the switch, then acknowledge.",
    cleared: false,
  };
  const times = (text: string, part: string) => text.split(part).length - 1;
  const described = () => {
    const id = screen.getByRole("button", { name: "Acknowledge" }).getAttribute("aria-describedby") ?? "";
    return document.getElementById(id)?.textContent ?? "";
  };

  it("says its reason and the next step once", () => {
    const { code, message, next_step } = pressed;
    const refusal = { code, message, next_step };
    const text = show({ arm_held: false, causes: [pressed], refusal });
    expect([times(text, message), times(text, next_step)]).toEqual([1, 1]);
    expect(described()).toContain(`${message} ${next_step}`);
    expect(text).not.toContain("still present");
  });

  it("marks the cause that is still present among several", () => {
    const { code, message, next_step } = pressed;
    const refusal = { code, message, next_step };
    show({ arm_held: false, causes: [cause, pressed], refusal });
    expect(described()).toBe(`${message} The cause is still present. ${next_step}`);
    expect(screen.getAllByText(/still present/)).toHaveLength(1);
  });

  it("says what else it waits for", () => {
    const refusal = {
      code: "not_verified",
      message: "The motors' settings are being checked.",
      next_step: "Wait a moment.",
    };
    show({ arm_held: false, refusal });
    expect(described()).toBe("The motors' settings are being checked. Wait a moment.");
    expect(screen.getByText(described())).toBeTruthy();
  });
});

describe("a hold on the stop's button", () => {
  const held = { arm_held: true, torque: "on" } as const;
  const another = { ...held, causes: [cause, { ...cause, code: "estop_pressed" }] };

  it.each([
    ["ends if the button becomes another one", { ...held, torqueFound: true }, held, 0],
    ["ends if another cause is shown", held, another, 0],
    ["continues if the state comes again", held, held, 1],
  ])("%s", async (_, before, after, times) => {
    vi.useFakeTimers();
    const release = vi.spyOn(api, "releaseTorque").mockResolvedValue({ accepted: true });
    const acknowledge = vi.spyOn(api, "acknowledge").mockResolvedValue({ accepted: true });
    const { rerender } = render(withState({ ...before }));
    fireEvent.pointerDown(screen.getByRole("button"), { button: 0, buttons: 1 });
    await act(() => vi.advanceTimersByTimeAsync(HOLD_MS / 2));
    rerender(withState({ ...after }));
    await act(() => vi.advanceTimersByTimeAsync(2 * HOLD_MS));
    expect(release).not.toHaveBeenCalled();
    expect(acknowledge).toHaveBeenCalledTimes(times);
    vi.useRealTimers();
  });
});
