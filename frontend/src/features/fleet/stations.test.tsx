import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { t } from "../../lib/i18n";
import { withoutJoiners } from "../../lib/joinUnits";
import { describeActivity, describeProgress, type Shown, type State, silentSince } from "./messages";
import { StationTile } from "./StationTile";
import { STATIONS_LOST_AFTER_MS, StationsStore } from "./store";

const state: State = {
  station: "Station 2",
  service: "00000000-0000-0000-0000-000000000001",
  simulated: false,
  device: "running",
  mode: "playing",
  torque: "on",
  estop: "closed",
  causes: [],
  arm_held: false,
  operator: "Sato",
  patient: { id: "00000000-0000-0000-0000-000000000002", name: "Yamada Hanako" },
  recording_name: "Flexion",
  progress: { position_s: 10, duration_s: 40, left_s: 30, reversing: false },
  take_s: null,
};
const shown: Shown = {
  name: "Station 2",
  here: false,
  heard_at: "2026-03-01T09:00:00Z",
  silent: false,
  doubled: false,
  patient_hidden: false,
  state,
};
const show = (station: Shown) =>
  render(
    <MantineProvider>
      <StationTile station={station} />
    </MantineProvider>,
  );

describe("a tile", () => {
  afterEach(cleanup);

  it("shows patient, mode, progress and emergency stop", () => {
    show(shown);
    for (const words of [
      "Yamada Hanako",
      "Flexion",
      "Playing, torque on",
      "30 s left",
      "E-stop ready",
      "Operated by Sato",
    ]) {
      expect(screen.getByText(words)).toBeDefined();
    }
  });

  it("distinguishes a free apparatus from a hidden patient", () => {
    const nameless = { ...shown, state: { ...state, patient: null } };
    show(nameless);
    expect(screen.getByText("No patient is on the apparatus.")).toBeDefined();
    cleanup();
    show({ ...nameless, patient_hidden: true });
    expect(screen.getByText("A patient whose record you may not see is on the apparatus.")).toBeDefined();
    expect(screen.queryByText("No patient is on the apparatus.")).toBeNull();
  });

  it("of a silent station shows only since when", () => {
    show({ ...shown, silent: true, state: null });
    expect(screen.getByText(t("fleet:stations.silent"))).toBeDefined();
    expect(screen.getByText(withoutJoiners(silentSince(shown.heard_at)))).toBeDefined();
    expect(screen.queryByText(/Yamada|Playing|E-stop/)).toBeNull();
  });

  it("shows why a station stopped", () => {
    const cause = {
      code: "bus_lost",
      category: 0 as const,
      message: "The bus is gone.",
      next_step: "",
      axis: null,
      cleared: false,
    };
    show({ ...shown, state: { ...state, mode: "stopped", estop: "pressed", causes: [cause] } });
    expect(screen.getByRole("alert").textContent).toBe("The bus is gone.");
    expect(screen.getByText("E-stop pressed")).toBeDefined();
  });

  it("trusts no state of a silent control program", () => {
    show({ ...shown, state: { ...state, device: "restarting", mode: "offline" } });
    expect(screen.getByText("E-stop unknown")).toBeDefined();
    expect(screen.getByText(t("fleet:stations.restarting"))).toBeDefined();
    expect(document.querySelector("[data-torque]")?.getAttribute("data-torque")).toBe("unknown");
  });

  it("tells torque on, off and unknown apart by form", () => {
    const looks = (["on", "off", "unknown"] as const).map((torque) => {
      show({ ...shown, state: { ...state, torque } });
      const sign = document.querySelector("[data-torque]");
      const look = [sign?.getAttribute("data-torque"), sign?.querySelector("svg")?.getAttribute("class")];
      cleanup();
      return look;
    });
    expect(looks.map(([torque]) => torque)).toEqual(["on", "off", "unknown"]);
    expect(new Set(looks.map(([, icon]) => icon)).size).toBe(3);
  });

  it("reports two services with one name", () => {
    show({ ...shown, doubled: true });
    expect(screen.getByRole("alert").textContent).toBe(t("fleet:stations.duplicateName"));
  });
});

describe("words", () => {
  it("describe a held and a returning arm", () => {
    const cause = { code: "x", category: 2 as const, message: "", next_step: "", axis: null, cleared: true };
    expect(describeActivity({ ...state, mode: "stopped", arm_held: true, causes: [cause] })).toBe(
      "Stopped, holding, torque on",
    );
    const progress = { position_s: 1, duration_s: 2, left_s: 1, reversing: true };
    expect(describeActivity({ ...state, progress })).toBe("Moving back after resistance, torque on");
  });

  it("describe no remaining time that depends on the patient", () => {
    const progress = { position_s: 2, duration_s: 2, left_s: null, reversing: false };
    expect(describeProgress({ ...state, progress })).toBe("");
  });

  it("describe the length of a take", () => {
    expect(describeProgress({ ...state, progress: null, take_s: 61 })).toBe("Take: 1\u00a0min 1\u00a0s");
    expect(describeProgress({ ...state, progress: null })).toBe("");
  });
});

describe("the store", () => {
  class FakeSocket {
    onmessage: ((event: { data: string }) => void) | null = null;
    onclose: (() => void) | null = null;
    closed = false;
    close() {
      this.closed = true;
    }
    say() {
      this.onmessage?.({ data: JSON.stringify({ sequence: 1, sent_at: "", stations: [shown] }) });
    }
  }
  let sockets: FakeSocket[];
  let store: StationsStore;
  const last = () => sockets.at(-1) as FakeSocket;

  beforeEach(() => {
    vi.useFakeTimers();
    sockets = [];
    store = new StationsStore(() => {
      const socket = new FakeSocket();
      sockets.push(socket);
      return socket as unknown as WebSocket;
    });
  });
  afterEach(() => vi.useRealTimers());

  it("is connected only while the page is shown", () => {
    expect(sockets).toHaveLength(0);
    const leave = store.subscribe(() => {});
    last().say();
    expect(store.get().stations).toEqual([shown]);
    leave();
    expect(last().closed).toBe(true);
    expect(store.get().stations).toBeNull();
  });

  it("discards outdated data and reconnects", () => {
    const leave = store.subscribe(() => {});
    last().say();
    vi.advanceTimersByTime(STATIONS_LOST_AFTER_MS + 300);
    expect(store.get()).toEqual({ stations: null, lost: true });
    vi.advanceTimersByTime(1000);
    expect(sockets).toHaveLength(2);
    last().say();
    expect(store.get()).toEqual({ stations: [shown], lost: false });
    leave();
  });
});
