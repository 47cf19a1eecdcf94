import type { PlotWindow } from "../../ui/plotWindow";
import { client, startAfter, unwrap } from "./request";
import type { Check, Schemas, SessionQuery } from "./types";

/** Programmes, sessions and their runs. */
export const sessionsApi = {
  programmes: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/programmes", { params: { path: { patient_id: key } } })),
  createProgramme: (key: string, body: Schemas["ProgrammeCreate"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/programmes", { params: { path: { patient_id: key } }, body }),
    ),
  previewProgramme: (key: string, body: Schemas["ProgrammePreviewRequest"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/programmes/preview", {
        params: { path: { patient_id: key } },
        body,
      }),
    ),
  programme: (key: string) =>
    unwrap(client.GET("/api/programmes/{programme_id}", { params: { path: { programme_id: key } } })),
  updateProgramme: (key: string, body: Schemas["ProgrammeUpdate"]) =>
    unwrap(client.PATCH("/api/programmes/{programme_id}", { params: { path: { programme_id: key } }, body })),
  createProgrammeVersion: (key: string, body: Schemas["VersionCreate"]) =>
    unwrap(
      client.POST("/api/programmes/{programme_id}/versions", {
        params: { path: { programme_id: key } },
        body,
      }),
    ),
  sessions: (query: SessionQuery, after: string | null = null, limit?: number) =>
    unwrap(client.GET("/api/sessions", { params: { query: { ...query, ...startAfter(after, limit) } } })),
  patientSessions: (key: string, after: string | null = null, limit = 50) =>
    unwrap(
      client.GET("/api/patients/{patient_id}/sessions", {
        params: { path: { patient_id: key }, query: { limit, ...startAfter(after) } },
      }),
    ),
  sessionFilterOptions: () => unwrap(client.GET("/api/sessions/filter-options")),
  session: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}", { params: { path: { session_id: key } } })),
  createSession: (body: Schemas["SessionCreate"]) => unwrap(client.POST("/api/sessions", { body })),
  updateSession: (key: string, body: Schemas["SessionUpdate"]) =>
    // With `keepalive` a note reaches the service even if the page is closing. Browsers allow this for up to 64 kB.
    unwrap(
      client.PATCH("/api/sessions/{session_id}", {
        params: { path: { session_id: key } },
        body,
        keepalive: (body.note?.length ?? 0) < 16_000,
      }),
    ),
  endSession: (key: string, body: Schemas["SessionEnd"] = {}) =>
    unwrap(client.POST("/api/sessions/{session_id}/end", { params: { path: { session_id: key } }, body })),
  checklist: (key: string, recording_id: string | null) =>
    unwrap(
      client.GET("/api/sessions/{session_id}/checklist", {
        params: { path: { session_id: key }, query: { recording_id } },
      }),
    ),
  confirmCheck: (key: string, check: Check["check"], body: Schemas["CheckConfirmation"]) =>
    unwrap(
      client.PUT("/api/sessions/{session_id}/checklist/{check}", {
        params: { path: { session_id: key, check } },
        body,
      }),
    ),
  draft: (key: string, language: "en" | "ja") =>
    unwrap(
      client.GET("/api/sessions/{session_id}/draft", {
        params: { path: { session_id: key }, query: { language } },
      }),
    ),
  signSession: (key: string, body: Schemas["SessionSign"]) =>
    unwrap(client.POST("/api/sessions/{session_id}/sign", { params: { path: { session_id: key } }, body })),
  addAddendum: (key: string, body: Schemas["AddendumCreate"]) =>
    unwrap(
      client.POST("/api/sessions/{session_id}/addenda", { params: { path: { session_id: key } }, body }),
    ),
  addGoniometerReading: (key: string, body: Schemas["GoniometerReadingCreate"]) =>
    unwrap(
      client.POST("/api/sessions/{session_id}/goniometer-readings", {
        params: { path: { session_id: key } },
        body,
      }),
    ),
  removeGoniometerReading: (session_id: string, reading_id: string) =>
    unwrap(
      client.DELETE("/api/sessions/{session_id}/goniometer-readings/{reading_id}", {
        params: { path: { session_id, reading_id } },
      }),
    ),
  sessionAlarms: (session_id: string) =>
    unwrap(client.GET("/api/events", { params: { query: { session_id, kind: "alarm", limit: 50 } } })),
  /** Returns the events in which resistance took the arm back. */
  sessionReversals: (session_id: string) =>
    unwrap(
      client.GET("/api/events", { params: { query: { session_id, code: "load_reversal", limit: 200 } } }),
    ),
  sessionPlan: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}/plan", { params: { path: { session_id: key } } })),
  runFigures: (key: string, window: PlotWindow | null, clock: "path" | "wall") =>
    unwrap(
      client.GET("/api/runs/{run_id}/figures", {
        params: { path: { run_id: key }, query: { ...window, clock } },
      }),
    ),
  playedMotion: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/played", { params: { path: { run_id: key } } })),
  runRhythm: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/rhythm", { params: { path: { run_id: key } } })),
  endFeel: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/end-feel", { params: { path: { run_id: key } } })),
  endFeelGuide: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}/end-feel", { params: { path: { session_id: key } } })),
  runMotion: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/motion", { params: { path: { run_id: key } } })),
};
