import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { forgetDrafts } from "../../lib/draft";
import { type LiveState, store } from "../../lib/live/store";
import { HOLD_MS } from "../../safety/useHold";
import { PlayPanel } from "../station/PlayPanel";
import { AS_TAUGHT } from "../station/playSettingsModel";

vi.mock("../auth/hooks", () => ({ useMayOperate: () => true, useHasPermission: () => true }));
vi.mock("../patients/StageWarning", () => ({ StageWarning: () => null }));
vi.mock("../station/session-wizard/PreflightChecklist", () => ({
  PreflightChecklist: () => null,
  useChecklist: () => ({ data: { complete: true } }),
}));

const GOAL = 10;
/** Motions with the same fixtures. A change of fixtures is confirmed by a press of its own. */
const MOTIONS = [3, 4, 5];
const SESSION = {
  id: "s",
  patient: { id: "p" },
  episode_id: "e",
  programme: null,
  runs: [{ ...AS_TAUGHT, recording_id: "r4", resistance_level: 20 }],
} as unknown as Session;

/** An apparatus that reaches each start within a second and plays at once. */
class Apparatus {
  readonly measured: string[] = [];
  /** Time from the answer until the run is shown as loaded. */
  loads_ms = 0;
  #listeners = new Set<() => void>();
  #request: Schemas["EndFeelLoadRequest"] | null = null;
  #state = {} as LiveState;

  constructor() {
    this.#become("idle");
    vi.spyOn(store, "get").mockImplementation(() => this.#state);
    vi.spyOn(store, "subscribe").mockImplementation((listener) => {
      this.#listeners.add(listener);
      return () => this.#listeners.delete(listener);
    });
    vi.spyOn(store, "waitForFreshState").mockResolvedValue();
    vi.spyOn(api, "loadEndFeel").mockImplementation(async (request) => {
      this.#request = request;
      if (this.loads_ms) setTimeout(() => this.#become("ready"), this.loads_ms);
      else this.#become("ready");
      return { id: "run" } as Schemas["Run"];
    });
    vi.spyOn(api, "approach").mockImplementation(async () => {
      this.#become("approaching");
      setTimeout(() => this.#become("paused"), 1000);
      return { accepted: true };
    });
    vi.spyOn(api, "play").mockImplementation(async () => {
      this.measured.push(`${this.#request?.kind} ${this.#request?.recording_id} ${this.#request?.torque_nm}`);
      this.#request = null;
      this.#become("idle");
      return { accepted: true };
    });
    vi.spyOn(api, "endFeelGuide").mockImplementation(async () => ({
      speed_deg_s: 5,
      motions: MOTIONS.map((motion) => this.#guided(motion)),
    }));
  }

  #guided(motion: number): Schemas["EndFeelMotion"] {
    const id = `r${motion}`;
    const hasBaseline = this.measured.some((done) => done.startsWith(`baseline ${id}`));
    return {
      recording_id: id,
      recording_name: id,
      motion,
      name: `motion ${motion}`,
      motor: 3,
      side: "right",
      baseline_run_id: hasBaseline ? "b" : null,
      end_deg: 90,
      tests: [],
      stretches: [],
    };
  }

  #become(mode: string) {
    const run = this.#request && {
      run_id: "run",
      reversals: 0,
      reversing: false,
      range_percent: 100,
      at_start: mode === "paused",
      changes: [],
      changes_keys: [],
    };
    const live = {
      device: "running",
      age_ms: 5,
      mode,
      stop: null,
      side: "right",
      run,
      refusals: {},
      stops: 0,
    };
    this.#state = { connected: true, heardAt: 0, station: null, live, events: [] } as unknown as LiveState;
    for (const listener of this.#listeners) listener();
  }
}

/** A user who counts presses. */
class User {
  presses = 0;

  async hold(name: string | RegExp, lasts_ms = HOLD_MS + 50) {
    const button = (await this.seen(name))[0] as HTMLElement;
    this.presses += 1;
    fireEvent.pointerDown(button, { button: 0, buttons: 1, isPrimary: true });
    await wait(lasts_ms);
    fireEvent.pointerUp(document.body);
    await wait(1500);
  }

  async press(name: string | RegExp) {
    this.presses += 1;
    fireEvent.click((await this.seen(name))[0] as HTMLElement);
  }

  async seen(name: string | RegExp) {
    for (let waited = 0; waited < 200 && !screen.queryAllByRole("button", { name }).length; waited += 1)
      await wait(20);
    return screen.getAllByRole("button", { name });
  }
}

const wait = (ms: number) => act(() => vi.advanceTimersByTimeAsync(ms));

async function begin() {
  const recordings = MOTIONS.map((motion) => ({ id: `r${motion}`, name: `r${motion}`, side: "right" }));
  vi.spyOn(api, "recordings").mockResolvedValue({ items: recordings } as never);
  vi.spyOn(api, "recording").mockResolvedValue({ id: "r4" } as never);
  vi.spyOn(api, "episodes").mockResolvedValue({ items: [] } as never);
  vi.spyOn(api, "patientSessions").mockResolvedValue({ items: [SESSION] } as never);
  vi.spyOn(api, "session").mockResolvedValue(SESSION);
  const apparatus = new Apparatus();
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <PlayPanel session={SESSION} wanted={null} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  const user = new User();
  await user.press("Measure the end-feel");
  return { apparatus, user };
}

beforeEach(() => vi.useFakeTimers());
afterEach(() => {
  vi.useRealTimers();
  cleanup();
  vi.restoreAllMocks();
  forgetDrafts();
});

it(`measures the baselines and tests of three motions with at most ${GOAL} presses`, async () => {
  const { apparatus, user } = await begin();
  for (const _ of MOTIONS) await user.hold("Hold to measure the baseline", 3.5 * HOLD_MS);
  for (const place of [0, 1, 2]) {
    const buttons = await user.seen("Move to the start of the test");
    (buttons[place] as HTMLElement).setAttribute("aria-label", "the next test");
    await user.hold("the next test");
    await user.hold(/^Play/);
  }
  expect(apparatus.measured).toEqual([
    ...MOTIONS.map((motion) => `baseline r${motion} 1.5`),
    ...MOTIONS.map((motion) => `test r${motion} 1.5`),
  ]);
  expect(user.presses).toBeLessThanOrEqual(GOAL);
});

it("keeps the chosen torque for the next motion", async () => {
  const { apparatus, user } = await begin();
  await user.seen("Hold to measure the baseline");
  fireEvent.change(screen.getByLabelText("Chosen torque, Nm"), { target: { value: "2" } });
  await user.hold("Hold to measure the baseline", 3.5 * HOLD_MS);
  await user.hold("Move to the start of the test");
  await user.hold(/^Play/);
  expect(apparatus.measured).toEqual(["baseline r3 2", "test r3 2"]);
});

it("waits for a slow computer while the button is held, and acts on the state that is shown then", async () => {
  const { apparatus, user } = await begin();
  vi.spyOn(store, "seen").mockImplementation(() => ({ stops: 0, seen_at: `${Date.now()}` }));
  const began_at = Date.now();
  apparatus.loads_ms = 4000;
  await user.hold("Hold to measure the baseline", 8 * HOLD_MS);
  expect(apparatus.measured).toEqual(["baseline r3 1.5"]);
  const approached = vi.mocked(api.approach).mock.lastCall?.[0];
  expect(Number(approached?.seen_at) - began_at).toBeGreaterThanOrEqual(apparatus.loads_ms);
});

it("does not move the arm of a slow computer after the release", async () => {
  const { apparatus, user } = await begin();
  apparatus.loads_ms = 4000;
  await user.hold("Hold to measure the baseline", 2 * HOLD_MS);
  await wait(8000);
  expect(api.approach).not.toHaveBeenCalled();
});

it.each([
  ["on the way to the start", HOLD_MS + 500],
  ["at the start", 2 * HOLD_MS + 500],
])("does not begin a baseline whose button is released %s", async (_, lasts_ms) => {
  const { apparatus, user } = await begin();
  await user.hold("Hold to measure the baseline", lasts_ms);
  await wait(5000);
  expect(apparatus.measured).toEqual([]);
  expect(await user.seen(/^Play/)).toBeTruthy();
});
