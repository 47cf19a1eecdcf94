import createClient from "openapi-fetch";
import type { components, paths } from "./schema";

export type Schemas = components["schemas"];
export type Patient = Schemas["Patient"];
export type Recording = Schemas["Recording"];
export type Session = Schemas["Session"];
export type Run = Schemas["Run"];
export type Live = Schemas["Live"];
export type StationInfo = Schemas["StationInfo"];
export type CommandName = keyof Live["refusals"];

/** An error answer of the service: a sentence, and what to do next. */
export class ProblemError extends Error {
  readonly code: string;
  readonly nextStep: string;
  /** By field name: what is wrong with it. */
  readonly fields: Record<string, string>;

  constructor(problem: Partial<Schemas["Problem"]>) {
    super(problem.detail ?? "The service gave an answer that cannot be understood.");
    this.code = problem.code ?? "unknown";
    this.nextStep = problem.next_step ?? "";
    this.fields = Object.fromEntries(
      (problem.errors ?? []).map((error) => [error.pointer.split("/").at(-1) ?? "", error.detail]),
    );
  }
}

// Looked up at each call, so that tests can put another in its place.
const client = createClient<paths>({ baseUrl: location.origin, fetch: (request) => fetch(request) });

/** The data of an answer, or the problem thrown. */
async function unwrap<T>(
  answer: Promise<{ data?: T; error?: unknown; response: Response }>,
): Promise<NonNullable<T>> {
  let given: { data?: T; error?: unknown };
  try {
    given = await answer;
  } catch {
    throw new ProblemError({
      code: "no_connection",
      detail: "The service does not answer.",
      next_step: "Check the network, and that the service is running.",
    });
  }
  if (given.data === undefined || given.data === null) {
    throw new ProblemError((given.error ?? {}) as Partial<Schemas["Problem"]>);
  }
  return given.data;
}

/** Every call that the page makes. */
export const api = {
  patients: (search: string, archived: boolean, offset: number) =>
    unwrap(client.GET("/api/patients", { params: { query: { search, archived, offset, limit: 50 } } })),
  patient: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}", { params: { path: { patient_id: key } } })),
  createPatient: (body: Schemas["PatientCreate"]) => unwrap(client.POST("/api/patients", { body })),
  updatePatient: (key: string, body: Schemas["PatientUpdate"]) =>
    unwrap(client.PATCH("/api/patients/{patient_id}", { params: { path: { patient_id: key } }, body })),
  recordings: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/recordings", { params: { path: { patient_id: key } } })),
  patientSessions: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/sessions", { params: { path: { patient_id: key } } })),
  recording: (key: string) =>
    unwrap(client.GET("/api/recordings/{recording_id}", { params: { path: { recording_id: key } } })),
  updateRecording: (key: string, body: Schemas["RecordingUpdate"]) =>
    unwrap(client.PATCH("/api/recordings/{recording_id}", { params: { path: { recording_id: key } }, body })),
  recordingFigure: (key: string) =>
    unwrap(client.GET("/api/recordings/{recording_id}/figure", { params: { path: { recording_id: key } } })),
  sessions: (offset: number) =>
    unwrap(client.GET("/api/sessions", { params: { query: { offset, limit: 50 } } })),
  session: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}", { params: { path: { session_id: key } } })),
  createSession: (patient_id: string) => unwrap(client.POST("/api/sessions", { body: { patient_id } })),
  updateSession: (key: string, body: Schemas["SessionUpdate"]) =>
    unwrap(client.PATCH("/api/sessions/{session_id}", { params: { path: { session_id: key } }, body })),
  endSession: (key: string) =>
    unwrap(client.POST("/api/sessions/{session_id}/end", { params: { path: { session_id: key } } })),
  runFigures: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/figures", { params: { path: { run_id: key } } })),
  teach: (body: { patient_id: string; name: string }) => unwrap(client.POST("/api/station/teach", { body })),
  load: (body: Schemas["LoadRequest"]) => unwrap(client.POST("/api/station/load", { body })),
  finishTeaching: () => unwrap(client.POST("/api/station/finish-teaching")),
  unload: () => unwrap(client.POST("/api/station/unload")),
  approach: () => unwrap(client.POST("/api/station/approach")),
  play: () => unwrap(client.POST("/api/station/play")),
  pause: () => unwrap(client.POST("/api/station/pause")),
  goBack: () => unwrap(client.POST("/api/station/return")),
  stop: () => unwrap(client.POST("/api/station/stop")),
  acknowledge: () => unwrap(client.POST("/api/station/acknowledge")),
  simulator: () => unwrap(client.GET("/api/simulator")),
  setPedal: (down: boolean) => unwrap(client.POST("/api/simulator/pedal", { body: { down } })),
  setEstop: (pressed: boolean) => unwrap(client.POST("/api/simulator/estop", { body: { pressed } })),
  guide: (motion_id: string) => unwrap(client.POST("/api/simulator/guide", { body: { motion_id } })),
  uploadMotion: (name: string, csv: string) =>
    unwrap(
      client.POST("/api/simulator/motions", {
        params: { query: { name } },
        body: csv,
        headers: { "Content-Type": "text/csv" },
        bodySerializer: (body) => body,
      }),
    ),
};
