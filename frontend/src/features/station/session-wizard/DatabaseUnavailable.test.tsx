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
import { SessionWizard } from "./SessionWizard";

const AWAY = new ProblemError({ code: "database_away", detail: "The database does not answer." });
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
        load_level: 25,
        method: "smooth",
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
  updated_at: "2026-11-21T09:30:00Z",
  runs: [],
};

function since(unavailable_since: string | null, waiting = 0) {
  const database = { unavailable_since, waiting, spool_full_since: null };
  const live = { device: "running", age_ms: 5, mode: "idle", run: null, refusals: {}, database };
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
}

let queries: QueryClient;
const around = (page: ReactNode) => (
  <MantineProvider env="test">
    <QueryClientProvider client={queries}>{page}</QueryClientProvider>
  </MantineProvider>
);
const show = (page: ReactNode) => render(around(page));

beforeEach(() => {
  queries = new QueryClient({ defaultOptions: { queries: { retry: false } } });
  since("2026-11-21T09:00:00Z");
  vi.spyOn(api, "patientSessions").mockRejectedValue(AWAY);
  vi.spyOn(api, "programmes").mockRejectedValue(AWAY);
  vi.spyOn(api, "recordings").mockRejectedValue(AWAY);
});
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe("while the database is away", () => {
  it("exactly those patients are offered whom the station keeps ready, with what must not be done", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    const onChange = vi.fn();
    show(<ReadySelect chosen="p" onChange={onChange} />);
    await screen.findByText("Contraindications: No traction.");
    fireEvent.click(screen.getByRole("combobox", { name: "Patient" }));
    const offered = await screen.findAllByRole("option", { hidden: true });
    expect(offered.map((one) => one.textContent)).toEqual(["Yamada Hanako (K-1)"]);
  });

  it("it is said that nobody is kept ready", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([]);
    show(<ReadySelect chosen={null} onChange={vi.fn()} />);
    await screen.findByText(/no patient is available/);
    expect(screen.getByRole("combobox", { name: "Patient" }).hasAttribute("disabled")).toBe(true);
  });

  it("a session is begun by the programme that is kept, and by nothing else", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    const create = vi.spyOn(api, "createSession").mockResolvedValue(SESSION);
    const onDone = vi.fn();
    show(<BeginStep patientId="p" session={null} onDone={onDone} />);
    await screen.findByText("1. Flexion: as taught, once");
    expect(screen.queryByText(/choose each recording/)).toBeNull();
    fireEvent.click(screen.getByRole("button", { name: "Begin the session" }));
    await waitFor(() => expect(onDone).toHaveBeenCalled());
    expect(create).toHaveBeenCalledWith({
      patient_id: "p",
      therapist: "Ito Mai",
      programme_version_id: "v",
    });
  });

  it("the visit goes on where it stands here", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([{ ...READY, session: SESSION }]);
    const checklist = vi.spyOn(api, "checklist").mockResolvedValue({ checks: [], complete: false });
    show(<SessionWizard patientId="p" wanted={null} />);
    await screen.findByRole("heading", { name: "Checklist" });
    await waitFor(() => expect(checklist).toHaveBeenCalledWith("s", "r"));
  });

  it("whoever is not kept ready is not made up: what the service said stands there", async () => {
    vi.spyOn(api, "readyPatients").mockResolvedValue([READY]);
    show(<SessionWizard patientId="somebody else" wanted={null} />);
    expect((await screen.findAllByText(/The database does not answer/)).length).toBeGreaterThan(0);
  });

  it("a session ends although its note cannot be saved; what was typed stays", async () => {
    vi.spyOn(api, "draft").mockRejectedValue(AWAY);
    vi.spyOn(api, "updateSession").mockRejectedValue(AWAY);
    const end = vi.spyOn(api, "endSession").mockResolvedValue({ ...SESSION, ended_at: "now" });
    show(<NoteCard session={SESSION} />);
    const note = await screen.findByRole("textbox", { name: "Note of this session" });
    fireEvent.change(note, { target: { value: "Typed" } });
    fireEvent.click(screen.getByRole("button", { name: "End the session" }));
    await waitFor(() => expect(end).toHaveBeenCalledWith("s", { reason: null }));
    expect(screen.getByDisplayValue("Typed")).toBeTruthy();
  });
});

it("everything is asked anew once the database answers again", () => {
  const invalidate = vi.spyOn(queries, "invalidateQueries");
  function Page() {
    useRefetchAfterOutage();
    return null;
  }
  const { rerender } = show(<Page />);
  expect(invalidate).not.toHaveBeenCalled();
  since(null);
  rerender(around(<Page />));
  expect(invalidate).toHaveBeenCalledTimes(1);
});

it("a note is not signed before the record of its session has arrived", async () => {
  const ended = { ...SESSION, note: "Lift", ended_at: "2026-11-21T10:00:00Z" };
  since(null, 1);
  const { rerender } = show(<NoteCard session={ended as unknown as Session} />);
  const sign = await screen.findByRole("button", { name: /^Sign as/ });
  expect((sign as HTMLButtonElement).disabled).toBe(true);
  screen.getByText("The record of this session is still being saved. You can sign when it is complete.");
  since(null, 0);
  rerender(around(<NoteCard session={{ ...ended } as unknown as Session} />));
  expect((sign as HTMLButtonElement).disabled).toBe(false);
});
