import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, ProblemError, type ReadyPatient, type Session } from "../../../lib/api/client";
import { type LiveState, store } from "../../../lib/live/store";
import { useRefetchAfterOutage } from "../../../lib/offline";
import { NoteCard } from "../../sessions/NoteCard";
import { ReadySelect } from "../ReadySelect";
import { BeginStep } from "./BeginStep";
import { PATIENT } from "./examples";
import { SessionWizard } from "./SessionWizard";

const UNAVAILABLE = new ProblemError({ code: "database_away", detail: "The database does not answer." });
const READY: ReadyPatient = {
  patient: { id: "p", name: "Yamada Hanako", clinic_number: "K-1" },
  side: "left",
  contraindications: "No traction.",
  programme: {
    id: "g",
    name: "Morning",
    version_id: "v",
    number: 2,
    timer_minutes: null,
    items: [
      {
        position: 1,
        recording_id: "r",
        recording_name: "Flexion",
        speed_percent: 100,
        repetitions: 1,
        pause_s: 0,
        range_percent: 100,
        resistance_level: 25,
        method: "smooth",
        self_paced: false,
      },
    ],
  },
  session: null,
};
const SESSION: Session = {
  id: "s",
  patient: READY.patient,
  episode_id: "e",
  side: "left",
  therapist: "Ito Mai",
  station: "Station 1",
  simulated: false,
  programme: READY.programme,
  started_at: "2026-11-21T09:00:00Z",
  ended_at: null,
  end_reason: null,
  checks: [],
  pain_before: null,
  pain_during: null,
  pain_after: null,
  note: "",
  signed_at: null,
  signed_by: "",
  addenda: [],
  goniometer_readings: [],
  updated_at: "2026-11-21T09:30:00Z",
  runs: [],
};

function setDatabase(unavailable_since: string | null, waiting = 0) {
  const database = { unavailable_since, waiting, spool_full_since: null };
  const live = { device: "running", age_ms: 5, mode: "idle", run: null, refusals: {}, database };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
}

let queries: QueryClient;
const withProviders = (page: ReactNode) => (
  <MantineProvider env="test">
    <QueryClientProvider client={queries}>{page}</QueryClientProvider>
  </MantineProvider>
);
const show = (page: ReactNode) => render(withProviders(page));

beforeEach(() => {
  queries = new QueryClient({ defaultOptions: { queries: { retry: false } } });
  setDatabase("2026-11-21T09:00:00Z");
  vi.spyOn(api, "patientSessions").mockRejectedValue(UNAVAILABLE);
  vi.spyOn(api, "programmes").mockRejectedValue(UNAVAILABLE);
  vi.spyOn(api, "recordings").mockRejectedValue(UNAVAILABLE);
});
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("while the database is unavailable", () => {
  it("offers only ready patients, with their contraindications", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    const onChange = vi.fn();
    show(<ReadySelect chosen="p" onChange={onChange} />);
    await screen.findByText("Contraindications: No traction.");
    fireEvent.click(screen.getByRole("combobox", { name: "Patient" }));
    const offered = await screen.findAllByRole("option", { hidden: true });
    expect(offered.map((option) => option.textContent)).toEqual(["Yamada Hanako (K-1)"]);
  });

  it("says that no patient can be treated now", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([]);
    show(<ReadySelect chosen={null} onChange={vi.fn()} />);
    await screen.findByText(/no patient can be treated now/);
    expect(screen.getByRole("combobox", { name: "Patient" }).hasAttribute("disabled")).toBe(true);
  });

  it("begins a session only with the stored programme", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    const create = vi.spyOn(api, "createSession").mockResolvedValue(SESSION);
    const onDone = vi.fn();
    show(<BeginStep patientId="p" session={null} onDone={onDone} />);
    await screen.findByText("1. Flexion: as taught, once; resistance level 25 of 25");
    expect(screen.queryByText(/choose each recording/)).toBeNull();
    fireEvent.click(screen.getByRole("button", { name: "Begin the session" }));
    await waitFor(() => expect(onDone).toHaveBeenCalled());
    expect(create).toHaveBeenCalledWith({
      patient_id: "p",
      therapist: "Ito Mai",
      programme_version_id: "v",
    });
  });

  it("continues the session from its stored state", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([{ ...READY, session: SESSION }]);
    const checklist = vi
      .spyOn(api, "checklist")
      .mockResolvedValue({ patient: PATIENT, checks: [], complete: false });
    show(<SessionWizard patientId="p" wanted={null} />);
    await screen.findByRole("heading", { name: "Checklist" });
    await waitFor(() => expect(checklist).toHaveBeenCalledWith("s", "r"));
  });

  it("shows the service's problem for other patients", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    show(<SessionWizard patientId="another" wanted={null} />);
    expect((await screen.findAllByText(/The database does not answer/)).length).toBeGreaterThan(0);
  });

  it("ends a session and keeps its unsaved note", async () => {
    vi.spyOn(api, "draft").mockRejectedValue(UNAVAILABLE);
    vi.spyOn(api, "updateSession").mockRejectedValue(UNAVAILABLE);
    const end = vi.spyOn(api, "endSession").mockResolvedValue({ ...SESSION, ended_at: "now" });
    show(<NoteCard session={SESSION} />);
    const note = await screen.findByRole("textbox", { name: "Note of this session" });
    fireEvent.change(note, { target: { value: "Typed" } });
    fireEvent.click(screen.getByRole("button", { name: "End the session" }));
    await waitFor(() => expect(end).toHaveBeenCalledWith("s", { reason: null }));
    expect(screen.getByDisplayValue("Typed")).toBeTruthy();
  });
});

it("refetches everything when the database answers again", () => {
  const invalidate = vi.spyOn(queries, "invalidateQueries");
  function Page() {
    useRefetchAfterOutage();
    return null;
  }
  const { rerender } = show(<Page />);
  expect(invalidate).not.toHaveBeenCalled();
  setDatabase(null);
  rerender(withProviders(<Page />));
  expect(invalidate).toHaveBeenCalledTimes(1);
});

it("cannot sign before the session's record is complete", async () => {
  const ended = { ...SESSION, note: "Lift", ended_at: "2026-11-21T10:00:00Z" };
  setDatabase(null, 1);
  const { rerender } = show(<NoteCard session={ended as unknown as Session} />);
  const sign = await screen.findByRole("button", { name: /^Sign as/ });
  expect((sign as HTMLButtonElement).disabled).toBe(true);
  screen.getByText("The record of this session is still being saved. You can sign when it is complete.");
  setDatabase(null, 0);
  rerender(withProviders(<NoteCard session={{ ...ended } as unknown as Session} />));
  expect((sign as HTMLButtonElement).disabled).toBe(false);
});
