import { MantineProvider, Modal } from "@mantine/core";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Schemas } from "../lib/api/client";
import { store } from "../lib/live/store";
import { loadServerTexts } from "../lib/serverText";
import japanese from "../locales/ja/server.json";
import { escapeStops, StopButton } from "./StopButton";

type Answer = Schemas["StopAnswerMessage"];

const fetchMock = vi.fn<(request: Request) => Promise<Response>>();

function show() {
  render(
    <MantineProvider>
      <StopButton />
      <input aria-label="anything" />
    </MantineProvider>,
  );
}

beforeEach(() => {
  fetchMock.mockReset();
  vi.stubGlobal("fetch", fetchMock);
});

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
  vi.unstubAllGlobals();
});

describe("Stop", () => {
  it("needs one press and shows sent, then confirmed", async () => {
    let answer: (response: Response) => void = () => {};
    fetchMock.mockReturnValue(new Promise((resolve) => (answer = resolve)));
    show();
    fireEvent.click(screen.getByRole("button", { name: /stop/i }));
    expect(screen.getByTestId("stop-answer").textContent).toContain("Sent");
    await waitFor(() => expect(fetchMock.mock.calls[0]?.[0].url).toContain("/api/station/stop"));
    answer(Response.json({ accepted: true }));
    await waitFor(() =>
      expect(screen.getByTestId("stop-answer").textContent).toContain("Confirmed by the device"),
    );
  });

  it("reports a missing confirmation", async () => {
    fetchMock.mockRejectedValue(new TypeError("network"));
    show();
    fireEvent.click(screen.getByRole("button", { name: /stop/i }));
    await waitFor(() => expect(screen.getByTestId("stop-answer").textContent).toContain("Not confirmed"));
    expect(screen.getByTestId("stop-answer").textContent).toContain("Use the emergency stop");
  });

  it("reacts to its key while typing, once per press", async () => {
    fetchMock.mockReturnValue(new Promise(() => {}));
    show();
    const input = screen.getByLabelText("anything");
    fireEvent.keyDown(input, { key: "Escape" });
    fireEvent.keyDown(input, { key: "Escape", repeat: true });
    fireEvent.keyDown(input, { key: "a" });
    await waitFor(() => expect(fetchMock).toHaveBeenCalled());
    expect(fetchMock).toHaveBeenCalledTimes(1);
  });
});

describe("Stop from a dialog", () => {
  async function showDialog(...controls: string[]) {
    render(
      <MantineProvider>
        <StopButton />
        <Modal opened onClose={() => {}} withCloseButton={false} transitionProps={{ duration: 0 }}>
          {controls.map((name) => (
            <button type="button" key={name}>
              {name}
            </button>
          ))}
        </Modal>
      </MantineProvider>,
    );
    await waitFor(() => expect(focused()).toBe(controls[0]));
  }

  const focused = () => document.activeElement?.textContent;
  const tab = (shiftKey = false) =>
    fireEvent.keyDown(document.activeElement ?? document.body, { key: "Tab", shiftKey });

  it("is after the last control and before the first one", async () => {
    await showDialog("Save", "Cancel");
    tab();
    expect(focused()).toBe("Cancel");
    tab();
    expect(focused()).toBe("Stop");
    tab();
    expect(focused()).toBe("Save");
    tab(true);
    expect(focused()).toBe("Stop");
    tab(true);
    expect(focused()).toBe("Cancel");
  });

  it("is one Tab away from a single control", async () => {
    await showDialog("Close");
    tab();
    expect(focused()).toBe("Stop");
    tab();
    expect(focused()).toBe("Close");
  });
});

describe("Stop with a live connection", () => {
  it("uses the connection and makes no request", async () => {
    const stop = vi.spyOn(store, "stop").mockResolvedValue({ refusal: null } as Answer);
    show();
    fireEvent.click(screen.getByRole("button", { name: /stop/i }));
    await waitFor(() =>
      expect(screen.getByTestId("stop-answer").textContent).toContain("Confirmed by the device"),
    );
    expect(stop).toHaveBeenCalledTimes(1);
    expect(fetchMock).not.toHaveBeenCalled();
  });

  it("is not confirmed by a device that does not answer", async () => {
    const refusal = { code: "no_answer", message: "The program did not answer.", next_step: "Look." };
    vi.spyOn(store, "stop").mockResolvedValue({ refusal } as Answer);
    show();
    fireEvent.click(screen.getByRole("button", { name: /stop/i }));
    await waitFor(() => expect(screen.getByTestId("stop-answer").textContent).toContain("did not answer"));
    expect(screen.getByTestId("stop-answer").textContent).toContain("Use the emergency stop");
  });

  it("is refused in the language of the page", async () => {
    await loadServerTexts("ja");
    const key = { code: "no_answer", params: {} };
    const refusal = { code: "no_answer", message: "It did not answer.", message_key: key, next_step: "" };
    vi.spyOn(store, "stop").mockResolvedValue({ refusal } as Answer);
    show();
    fireEvent.click(screen.getByRole("button", { name: /stop/i }));
    await waitFor(() => expect(screen.getByTestId("stop-answer").dataset.state).toBe("failed"));
    expect(screen.getByTestId("stop-answer").textContent).toContain(japanese.no_answer);
    await loadServerTexts("en");
  });
});

describe("the Esc key", () => {
  it.each(["approaching", "playing", "paused", "returning"] as const)("stops while %s", (mode) => {
    expect(escapeStops(true, { mode })).toBe(true);
  });

  it.each(["idle", "teaching", "ready", "stopped", "offline"] as const)(
    "is left to dialogs while %s",
    (mode) => {
      expect(escapeStops(true, { mode })).toBe(false);
    },
  );

  it("stops while a technician commissions the station", () => {
    const teach = { code: "commissioning_runs", message: "It runs.", next_step: "Wait." };
    expect(escapeStops(true, { mode: "offline", refusals: { teach } })).toBe(true);
  });

  it("stops when the state is unknown", () => {
    expect(escapeStops(false, { mode: "idle" })).toBe(true);
    expect(escapeStops(true, null)).toBe(true);
  });
});
