import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type Check, ProblemError, type Session } from "../../../lib/api/client";
import { authStore } from "../../auth/authState";
import { VIEWER } from "../../auth/testUsers";
import { NoteCard } from "../../sessions/NoteCard";
import { BeginStep } from "./BeginStep";
import { PATIENT } from "./examples";
import { NrsScale } from "./NrsScale";
import { PreflightChecklist } from "./PreflightChecklist";

const SESSION: Session = {
  id: "s",
  patient: { id: "p", name: "Yamada Hanako", clinic_number: "K-1" },
  episode_id: "e",
  side: "left",
  therapist: "Ito Mai",
  station: "Station 1",
  simulated: false,
  programme: null,
  started_at: "2026-11-21T09:00:00Z",
  ended_at: null,
  end_reason: null,
  checks: [],
  pain_before: 4,
  pain_during: null,
  pain_after: 2,
  note: "",
  signed_at: null,
  signed_by: "",
  addenda: [],
  goniometer_readings: [],
  updated_at: "2026-11-21T09:30:00Z",
  runs: [],
};

const check = (name: Check["check"], given: boolean, detected = false): Check => ({
  check: name,
  subject: name === "fixtures" ? "arm_fixer_2+elbow_fixer_2" : "",
  sentence: `About the ${name}.`,
  detected,
  given,
  checked_by: given && !detected ? "Ito Mai" : null,
  checked_at: given ? "2026-11-21T09:10:00Z" : null,
});

function show(page: ReactNode) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        {page}
      </QueryClientProvider>
    </MantineProvider>,
  );
}

const button = (name: string | RegExp) => screen.getByRole("button", { name });
const type = (label: string, value: string) =>
  fireEvent.change(screen.getByRole("textbox", { name: label }), { target: { value } });

beforeEach(() => {
  vi.restoreAllMocks();
});
afterEach(cleanup);

describe("the checklist", () => {
  it("has buttons for manual checks only", async () => {
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [check("side", true), check("belt", false), check("estop", false, true)],
      complete: false,
    });
    const tick = vi
      .spyOn(api, "confirmCheck")
      .mockResolvedValue({ patient: PATIENT, checks: [], complete: true });
    show(<PreflightChecklist sessionId="s" recordingId="r" />);
    await screen.findByText("About the side.");
    expect(screen.getByTestId("check-side").textContent).toContain("Ito Mai");
    expect(screen.getByTestId("check-estop").textContent).toContain("Not detected yet. Press the switch");
    expect(screen.getAllByRole("button")).toHaveLength(1);
    fireEvent.click(button("Confirm: About the belt."));
    await waitFor(() =>
      expect(tick).toHaveBeenCalledWith("s", "belt", { checked_by: "Ito Mai", recording_id: "r" }),
    );
  });

  it("confirms all checks with one press and reports completion once", async () => {
    const open = [check("side", false), check("fixtures", false), check("belt", false)];
    const seen = check("estop", true, true);
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [...open, seen],
      complete: false,
    });
    const tick = vi
      .spyOn(api, "confirmCheck")
      .mockImplementation((_, name) =>
        Promise.resolve({ patient: PATIENT, checks: [...open, seen], complete: name === "belt" }),
      );
    const onComplete = vi.fn();
    show(<PreflightChecklist sessionId="s" recordingId="r" onComplete={onComplete} />);
    fireEvent.click(await screen.findByRole("button", { name: "Confirm all 3 checks" }));
    await waitFor(() => expect(onComplete).toHaveBeenCalledTimes(1));
    expect(tick.mock.calls.map(([, name]) => name)).toEqual(["side", "fixtures", "belt"]);
  });

  it("counts confirmed checks in the bar, and confirms all after the last check", async () => {
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [check("side", false), check("belt", false), check("pedal", true, true)],
      complete: false,
    });
    show(<PreflightChecklist sessionId="s" recordingId="r" next={<button type="button">Skip</button>} />);
    const bar = (await screen.findByText("1 of 3 confirmed")).parentElement as HTMLElement;
    const names = within(bar)
      .getAllByRole("button")
      .map(({ textContent }) => textContent);
    // In the bar, which stays on the screen, the checks could be confirmed unseen.
    expect(names).toEqual(["Skip"]);
    const all = screen.getByRole("button", { name: "Confirm all 2 checks" });
    expect(all.compareDocumentPosition(bar) & Node.DOCUMENT_POSITION_FOLLOWING).toBeTruthy();
  });

  it("stops at a refused check and shows why", async () => {
    const open = [check("side", false), check("fixtures", false)];
    vi.spyOn(api, "checklist").mockResolvedValue({ patient: PATIENT, checks: open, complete: false });
    const tick = vi
      .spyOn(api, "confirmCheck")
      .mockRejectedValue(new ProblemError({ detail: "This session has ended." }));
    const onComplete = vi.fn();
    show(<PreflightChecklist sessionId="s" recordingId="r" onComplete={onComplete} />);
    fireEvent.click(await screen.findByRole("button", { name: /Confirm all 2 checks/ }));
    expect((await screen.findByRole("alert")).textContent).toContain("has ended");
    expect(tick).toHaveBeenCalledTimes(1);
    expect(onComplete).not.toHaveBeenCalled();
  });

  it("confirms the identity only with two identifiers that agree", async () => {
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [check("identity", false), check("belt", false), check("side", false)],
      complete: false,
    });
    const tick = vi.spyOn(api, "confirmCheck").mockResolvedValue({
      patient: PATIENT,
      checks: [],
      complete: false,
    });
    show(<PreflightChecklist sessionId="s" recordingId="r" />);
    const confirm = await screen.findByRole("button", { name: "Confirm the identity" });
    // Pressing the button for the other checks must not confirm the identity.
    expect(button("Confirm all 2 checks")).toBeTruthy();
    expect(confirm.hasAttribute("disabled")).toBe(true);
    fireEvent.click(screen.getByRole("checkbox", { name: "Stated name: Yamada Hanako (ヤマダ ハナコ)" }));
    expect(confirm.hasAttribute("disabled")).toBe(true);
    fireEvent.click(screen.getByRole("checkbox", { name: /Birth date/ }));
    fireEvent.click(confirm);
    await waitFor(() =>
      expect(tick).toHaveBeenCalledWith("s", "identity", {
        checked_by: "Ito Mai",
        recording_id: "r",
        identifiers: ["name", "birth_date"],
      }),
    );
  });

  it("does not offer a birth date that the record lacks", async () => {
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: { ...PATIENT, birth_date: null },
      checks: [check("identity", false)],
      complete: false,
    });
    show(<PreflightChecklist sessionId="s" recordingId="r" />);
    expect((await screen.findAllByRole("checkbox")).length).toBe(2);
    expect(screen.queryByRole("checkbox", { name: /Birth date/ })).toBeNull();
  });

  it("can show only open checks", async () => {
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [check("side", true), check("fixtures", false)],
      complete: false,
    });
    show(<PreflightChecklist sessionId="s" recordingId="r" onlyOpen />);
    await screen.findByText("About the fixtures.");
    expect(screen.queryByText("About the side.")).toBeNull();
  });

  it("is read-only without permission", async () => {
    authStore.signedIn(VIEWER);
    vi.spyOn(api, "checklist").mockResolvedValue({
      patient: PATIENT,
      checks: [check("belt", false)],
      complete: false,
    });
    show(<PreflightChecklist sessionId="s" recordingId={null} />);
    await screen.findByText("About the belt.");
    expect(screen.queryByRole("button")).toBeNull();
  });
});

describe("before a session", () => {
  it("shows resistance, timer and the limits in force", async () => {
    const item = {
      recording_name: "Flexion",
      ...{ position: 1, speed_percent: 100, repetitions: 1, pause_s: 0, range_percent: 90 },
      ...{ resistance_level: 18, method: "smooth", self_paced: false, end_range: null },
    };
    const version = { id: "v", number: 2, timer_minutes: 30, items: [item] };
    const episode = { limits_by: "Dr Abe", limits: [], max_resistance_level: 20, max_speed_deg_s: null };
    vi.spyOn(api, "programmes").mockResolvedValue({
      items: [{ name: "Morning", archived_at: null, current: version }],
    } as never);
    vi.spyOn(api, "patient").mockResolvedValue({ id: "p", episode_id: "e" } as never);
    vi.spyOn(api, "episodes").mockResolvedValue({
      items: [
        { id: "older", ...episode, max_resistance_level: 25 },
        { id: "e", ...episode },
      ],
    } as never);
    show(<BeginStep patientId="p" session={null} onDone={() => {}} />);
    await screen.findByText("1. Flexion: 90 % of the range; resistance level 18 of 25");
    expect(screen.getByText("Timer: 30 minutes")).toBeTruthy();
    const limits = await screen.findByTestId("limits");
    // A programme of many items would push them off the screen.
    const before = screen.getByText("Timer: 30 minutes").compareDocumentPosition(limits);
    expect(before).toBe(Node.DOCUMENT_POSITION_PRECEDING);
    expect(limits.textContent).toBe("Limits set by Dr AbeResistance level: at most 20\u00a0of\u00a025");
  });
});

describe("pain", () => {
  it("is one press from 0 to 10", () => {
    const onChange = vi.fn();
    show(<NrsScale label="Pain before" value={4} onChange={onChange} />);
    expect(screen.getAllByRole("button")).toHaveLength(11);
    expect(button("Pain before: 4").getAttribute("aria-pressed")).toBe("true");
    fireEvent.click(button("Pain before: 0"));
    expect(onChange).toHaveBeenCalledWith(0);
  });
});

describe("the note", () => {
  beforeEach(() => {
    vi.spyOn(api, "draft").mockResolvedValue({ text: "Left shoulder. Done.", end_reason: "completed" });
  });

  it("starts with the draft and ends the session", async () => {
    const update = vi.spyOn(api, "updateSession").mockResolvedValue({ ...SESSION, note: "Edited." });
    const end = vi.spyOn(api, "endSession").mockResolvedValue({ ...SESSION, ended_at: "now" });
    show(<NoteCard session={SESSION} />);
    await screen.findByDisplayValue("Left shoulder. Done.");
    type("Note of this session", "Edited.");
    expect(screen.getByRole("status").textContent).toBe("Not saved yet");
    fireEvent.click(button("End the session"));
    await waitFor(() => expect(end).toHaveBeenCalledWith("s", { reason: "completed" }));
    expect(update).toHaveBeenCalledWith("s", { note: "Edited.", updated_at: SESSION.updated_at });
  });

  it("takes no text while the draft is loading", async () => {
    let answer = (_: Awaited<ReturnType<typeof api.draft>>) => {};
    vi.spyOn(api, "draft").mockReturnValue(
      new Promise((resolve) => {
        answer = resolve;
      }),
    );
    show(<NoteCard session={SESSION} />);
    const field = await screen.findByRole<HTMLTextAreaElement>("textbox", { name: "Note of this session" });
    expect(screen.getByRole("status").textContent).toBe("Drafting the note from the measurements …");
    expect(field.readOnly).toBe(true);
    answer({ text: "Left shoulder. Done.", end_reason: "completed" });
    await screen.findByDisplayValue("Left shoulder. Done.");
    expect(field.readOnly).toBe(false);
    expect(screen.getByRole("status").textContent).toContain("Drafted from the measurements.");
  });

  it("takes text when the draft fails", async () => {
    vi.spyOn(api, "draft").mockRejectedValue(new Error("failed"));
    show(<NoteCard session={SESSION} />);
    const field = await screen.findByRole<HTMLTextAreaElement>("textbox", { name: "Note of this session" });
    await waitFor(() => expect(field.readOnly).toBe(false));
    expect(screen.getByRole("status").textContent).toBe("");
  });

  it("is drafted in the language of papers", async () => {
    localStorage.setItem("kata.report-language", '"ja"');
    const draft = vi.spyOn(api, "draft").mockResolvedValue({ text: "左肩。", end_reason: "completed" });
    show(<NoteCard session={SESSION} />);
    await screen.findByDisplayValue("左肩。");
    expect(draft).toHaveBeenCalledWith("s", "ja");
    localStorage.clear();
  });

  it("is saved automatically", async () => {
    const update = vi.spyOn(api, "updateSession").mockResolvedValue(SESSION);
    show(<NoteCard session={SESSION} />);
    await screen.findByDisplayValue("Left shoulder. Done.");
    type("Note of this session", "Typed");
    await waitFor(() => expect(update).toHaveBeenCalledTimes(1), { timeout: 3000 });
  });

  it("is signed by the user", async () => {
    const ended = { ...SESSION, note: "Done.", ended_at: "2026-11-21T09:40:00Z" };
    const sign = vi.spyOn(api, "signSession").mockResolvedValue({ ...ended, signed_at: "now" });
    show(<NoteCard session={ended} />);
    fireEvent.click(button("Sign as Ito Mai"));
    await waitFor(() =>
      expect(sign).toHaveBeenCalledWith("s", {
        signed_by: "Ito Mai",
        note: "Done.",
        updated_at: SESSION.updated_at,
      }),
    );
  });

  it("reports another user's change and keeps the input", async () => {
    vi.spyOn(api, "updateSession").mockRejectedValue(
      new ProblemError({ detail: "Somebody else has changed this session in the meantime." }),
    );
    show(<NoteCard session={SESSION} />);
    await screen.findByDisplayValue("Left shoulder. Done.");
    type("Note of this session", "Mine");
    fireEvent.click(button("End the session"));
    expect((await screen.findByRole("alert")).textContent).toContain("Somebody else has changed");
    expect(screen.getByDisplayValue("Mine")).toBeTruthy();
  });

  it("is read-only without permission", () => {
    authStore.signedIn(VIEWER);
    show(<NoteCard session={{ ...SESSION, note: "As it stands." }} />);
    expect(screen.getByText("As it stands.")).toBeTruthy();
    expect(screen.queryByRole("button")).toBeNull();
    expect(screen.queryByRole("textbox")).toBeNull();
  });

  it("accepts only addenda after signing", async () => {
    const signed: Session = {
      ...SESSION,
      note: "As signed.",
      ended_at: "2026-11-21T09:40:00Z",
      signed_at: "2026-11-21T09:45:00Z",
      signed_by: "Ito Mai",
    };
    const add = vi.spyOn(api, "addAddendum").mockResolvedValue(signed);
    show(<NoteCard session={signed} />);
    expect(screen.queryByRole("textbox", { name: "Note of this session" })).toBeNull();
    expect(screen.getByTestId("signed").textContent).toContain("Signed by Ito Mai");
    expect(button("Add as Ito Mai").hasAttribute("disabled")).toBe(true);
    type("Addendum", "Slept well.");
    fireEvent.click(button("Add as Ito Mai"));
    await waitFor(() =>
      expect(add).toHaveBeenCalledWith("s", { written_by: "Ito Mai", text: "Slept well." }),
    );
  });
});
