import createClient from "openapi-fetch";
import type { PlotWindow } from "../../ui/plotWindow";
import { t } from "../i18n";
import type { Language } from "../language";
import { translateServerText } from "../serverText";
import type { components, paths } from "./schema";

export type Schemas = components["schemas"];
export type Patient = Schemas["Patient"];
export type Recording = Schemas["Recording"];
/** An edit of a recording. */
export type Edit =
  | Schemas["Trim"]
  | Schemas["Hold"]
  | Schemas["Scale"]
  | Schemas["Isolate"]
  | Schemas["WarmUp"]
  | Schemas["Stretch"]
  | Schemas["Mirror"];
export type Episode = Schemas["Episode"];
export type Assessment = Schemas["Assessment"];
export type Session = Schemas["Session"];
/** Filters of the sessions, combined with "and". */
export type SessionQuery = Omit<
  NonNullable<paths["/api/sessions"]["get"]["parameters"]["query"]>,
  "after" | "limit"
>;
/** A patient whose session can start without the database. */
export type ReadyPatient = Schemas["ReadyPatient"];
export type Run = Schemas["Run"];
export type Check = Schemas["SessionCheck"];
export type Programme = Schemas["ProgrammeDetail"];
export type ProgrammeVersion = Schemas["ProgrammeVersion"];
export type ProgrammeItem = Schemas["ProgrammeItem"];
export type Live = Schemas["Live"];
export type StationInfo = Schemas["StationInfo"];
export type Chart =
  paths["/api/episodes/{episode_id}/progress/{chart}"]["get"]["parameters"]["path"]["chart"];
export type CommandName = keyof Live["refusals"];
/** The signed-in user. */
export type Me = Schemas["Me"];
export type Account = Schemas["Account"];
/** Filters of the audit trail, combined with "and". */
export type AuditQuery = Omit<
  NonNullable<paths["/api/audit"]["get"]["parameters"]["query"]>,
  "after" | "limit"
>;

/** An error answer of the service, with a message and the next step. */
export class ProblemError extends Error {
  readonly code: string;
  readonly nextStep: string;
  /** Error messages by field name. */
  readonly fields: Record<string, string>;

  constructor(problem: Partial<Schemas["Problem"]>) {
    super(
      problem.detail === undefined
        ? t("common:unheard.unclear")
        : translateServerText(problem.detail, problem.detail_key),
    );
    this.code = problem.code ?? "unknown";
    this.nextStep = translateServerText(problem.next_step ?? "", problem.next_step_key);
    this.fields = Object.fromEntries(
      (problem.errors ?? []).map((error) => [
        error.pointer.split("/").at(-1) ?? "",
        translateServerText(error.detail, error.detail_key),
      ]),
    );
  }
}

/**
 * The HTTP client of all calls; authMiddleware is registered here. `fetch` is looked up at each call, so that
 * tests can replace it.
 */
export const client = createClient<paths>({
  baseUrl: location.origin,
  fetch: (request) => fetch(request),
});

/** Return the data of the answer, or throw the problem. */
async function unwrap<T>(
  request: Promise<{ data?: T; error?: unknown; response: Response }>,
): Promise<NonNullable<T>> {
  let result: { data?: T; error?: unknown };
  try {
    result = await request;
  } catch {
    throw new ProblemError({
      code: "no_connection",
      detail: t("common:unheard.silent"),
      next_step: t("common:unheard.check"),
    });
  }
  if (result.data === undefined || result.data === null) {
    throw new ProblemError((result.error ?? {}) as Partial<Schemas["Problem"]>);
  }
  return result.data;
}

/** Throw the problem of an answer without data. */
async function expectSuccess(request: Promise<{ error?: unknown; response: Response }>): Promise<void> {
  await unwrap(
    request.then(({ error, response }) => ({ ...(response.ok ? { data: true } : { error }), response })),
  );
}

/** Return the query that continues a list after its last known row. */
const startAfter = (after: string | null) => (after === null ? {} : { after });

/** Fetch every page of a list. */
async function allPages<Item>(
  fetchPage: (after: string | null) => Promise<{ items: Item[]; next: string | null }>,
): Promise<{ items: Item[] }> {
  const items: Item[] = [];
  let after: string | null = null;
  do {
    const page = await fetchPage(after);
    items.push(...page.items);
    after = page.next;
  } while (after);
  return { items };
}

/** Longer than the service waits for the device. */
const STOP_TIMEOUT_MS = 4000;

/** All calls of the page. */
export const api = {
  // Login
  me: () => unwrap(client.GET("/api/me")),
  signIn: (body: Schemas["SignIn"]) => unwrap(client.POST("/api/sign-in", { body })),
  signInByLink: (secret: string) => unwrap(client.POST("/api/sign-in/link", { body: { secret } })),
  loginMethods: () => unwrap(client.GET("/api/sign-in")),
  beginOpenId: (to: string) => unwrap(client.POST("/api/sign-in/openid/begin", { body: { to } })),
  signInByOpenId: (body: Schemas["OidcCallback"]) => unwrap(client.POST("/api/sign-in/openid", { body })),
  confirmOpenId: (code: string) => unwrap(client.POST("/api/sign-in/openid/code", { body: { code } })),
  signOut: () => expectSuccess(client.POST("/api/sign-out")),
  setUp: (body: Schemas["SetUp"]) => unwrap(client.POST("/api/set-up", { body })),
  setPassword: (body: Schemas["SetPassword"]) => expectSuccess(client.POST("/api/set-password", { body })),
  lockScreen: () => expectSuccess(client.POST("/api/me/lock")),
  unlock: (password: string) => unwrap(client.POST("/api/me/unlock", { body: { password } })),
  chooseLanguage: (language: Language) => unwrap(client.PUT("/api/me/language", { body: { language } })),
  changePassword: (body: Schemas["ChangePassword"]) =>
    expectSuccess(client.POST("/api/me/password", { body })),
  beginSecondFactor: (password: string | null) =>
    unwrap(client.POST("/api/me/second-factor", { body: { password } })),
  confirmSecondFactor: (code: string) => unwrap(client.PUT("/api/me/second-factor", { body: { code } })),
  removeSecondFactor: (password: string | null) =>
    expectSuccess(client.DELETE("/api/me/second-factor", { body: { password } })),
  loginSessions: () => unwrap(client.GET("/api/me/sign-ins")),
  endLoginSession: (sign_in_id: string, password: string | null) =>
    expectSuccess(
      client.DELETE("/api/me/sign-ins/{sign_in_id}", {
        params: { path: { sign_in_id } },
        body: { password },
      }),
    ),
  // Administration
  accounts: () => unwrap(client.GET("/api/accounts")),
  createAccount: (body: Schemas["AccountCreate"]) => unwrap(client.POST("/api/accounts", { body })),
  updateAccount: (account_id: string, body: Schemas["AccountUpdate"]) =>
    unwrap(client.PATCH("/api/accounts/{account_id}", { params: { path: { account_id } }, body })),
  resetAccount: (account_id: string, body: Schemas["Reset"]) =>
    unwrap(client.POST("/api/accounts/{account_id}/reset", { params: { path: { account_id } }, body })),
  audit: (query: AuditQuery, after: string | null = null) =>
    unwrap(client.GET("/api/audit", { params: { query: { ...query, ...startAfter(after) } } })),
  stationVersions: (station: string) =>
    unwrap(client.GET("/api/station-versions", { params: { query: { station } } })),
  backups: () => unwrap(client.GET("/api/backups")),
  makeBackup: () => unwrap(client.POST("/api/backups")),
  recordAccess: (patient_id: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/access", { params: { path: { patient_id } } })),
  changeRecordAccess: (patient_id: string, body: Schemas["RecordAccessChange"]) =>
    unwrap(client.PUT("/api/patients/{patient_id}/access", { params: { path: { patient_id } }, body })),
  breakGlass: (patient_id: string, body: Schemas["BreakGlass"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/break-glass-accesses", {
        params: { path: { patient_id } },
        body,
      }),
    ),
  breakGlassAccesses: (after: string | null = null) =>
    unwrap(client.GET("/api/break-glass-accesses", { params: { query: startAfter(after) } })),
  reviewBreakGlassAccess: (glass_id: string) =>
    unwrap(client.POST("/api/break-glass-accesses/{glass_id}/review", { params: { path: { glass_id } } })),
  patients: (search: string, archived: boolean, after: string | null = null) =>
    unwrap(client.GET("/api/patients", { params: { query: { search, archived, ...startAfter(after) } } })),
  patient: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}", { params: { path: { patient_id: key } } })),
  createPatient: (body: Schemas["PatientCreate"]) => unwrap(client.POST("/api/patients", { body })),
  updatePatient: (key: string, body: Schemas["PatientUpdate"]) =>
    unwrap(client.PATCH("/api/patients/{patient_id}", { params: { path: { patient_id: key } }, body })),
  /** All pages, because lists to choose from show every recording. */
  recordings: (key: string) =>
    allPages((after) =>
      unwrap(
        client.GET("/api/patients/{patient_id}/recordings", {
          params: { path: { patient_id: key }, query: { limit: 200, ...startAfter(after) } },
        }),
      ),
    ),
  patientSessions: (key: string, after: string | null = null) =>
    unwrap(
      client.GET("/api/patients/{patient_id}/sessions", {
        params: { path: { patient_id: key }, query: startAfter(after) },
      }),
    ),
  // Episodes
  episodes: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/episodes", { params: { path: { patient_id: key } } })),
  openEpisode: (key: string, body: Schemas["EpisodeCreate"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/episodes", { params: { path: { patient_id: key } }, body }),
    ),
  updateEpisode: (key: string, body: Schemas["EpisodeUpdate"]) =>
    unwrap(client.PATCH("/api/episodes/{episode_id}", { params: { path: { episode_id: key } }, body })),
  closeEpisode: (key: string, body: Schemas["EpisodeClose"]) =>
    unwrap(client.POST("/api/episodes/{episode_id}/close", { params: { path: { episode_id: key } }, body })),
  reopenEpisode: (key: string) =>
    unwrap(client.POST("/api/episodes/{episode_id}/reopen", { params: { path: { episode_id: key } } })),
  addStage: (key: string, body: Schemas["StageCreate"]) =>
    unwrap(client.POST("/api/episodes/{episode_id}/stages", { params: { path: { episode_id: key } }, body })),
  removeStage: (episode_id: string, stage_id: string) =>
    unwrap(
      client.DELETE("/api/episodes/{episode_id}/stages/{stage_id}", {
        params: { path: { episode_id, stage_id } },
      }),
    ),
  recording: (key: string) =>
    unwrap(client.GET("/api/recordings/{recording_id}", { params: { path: { recording_id: key } } })),
  updateRecording: (key: string, body: Schemas["RecordingUpdate"]) =>
    unwrap(client.PATCH("/api/recordings/{recording_id}", { params: { path: { recording_id: key } }, body })),
  recordingFigure: (key: string, window: PlotWindow | null) =>
    unwrap(
      client.GET("/api/recordings/{recording_id}/figure", {
        params: { path: { recording_id: key }, query: window ?? {} },
      }),
    ),
  recordingMotion: (key: string) =>
    unwrap(client.GET("/api/recordings/{recording_id}/motion", { params: { path: { recording_id: key } } })),
  runMotion: (key: string) =>
    unwrap(client.GET("/api/runs/{run_id}/motion", { params: { path: { run_id: key } } })),
  previewDerived: (key: string, body: Edit) =>
    unwrap(
      client.POST("/api/recordings/{recording_id}/derived/preview", {
        params: { path: { recording_id: key } },
        body,
      }),
    ),
  derive: (key: string, body: Edit) =>
    unwrap(
      client.POST("/api/recordings/{recording_id}/derived", {
        params: { path: { recording_id: key } },
        body,
      }),
    ),
  sessions: (query: SessionQuery, after: string | null = null) =>
    unwrap(client.GET("/api/sessions", { params: { query: { ...query, ...startAfter(after) } } })),
  sessionFilterOptions: () => unwrap(client.GET("/api/sessions/filter-options")),
  // Assessments and progress
  assessmentForm: () => unwrap(client.GET("/api/assessments/form")),
  assessments: (key: string, after: string | null = null) =>
    unwrap(
      client.GET("/api/episodes/{episode_id}/assessments", {
        params: { path: { episode_id: key }, query: startAfter(after) },
      }),
    ),
  createAssessment: (key: string, body: Schemas["AssessmentCreate"]) =>
    unwrap(
      client.POST("/api/episodes/{episode_id}/assessments", { params: { path: { episode_id: key } }, body }),
    ),
  updateAssessment: (key: string, body: Schemas["AssessmentUpdate"]) =>
    unwrap(
      client.PATCH("/api/assessments/{assessment_id}", { params: { path: { assessment_id: key } }, body }),
    ),
  withdrawAssessment: (key: string, updated_at: string) =>
    unwrap(
      client.POST("/api/assessments/{assessment_id}/withdraw", {
        params: { path: { assessment_id: key } },
        body: { updated_at },
      }),
    ),
  progress: (key: string, chart: Chart) =>
    unwrap(
      client.GET("/api/episodes/{episode_id}/progress/{chart}", {
        params: { path: { episode_id: key, chart } },
      }),
    ),
  readyPatients: async () => (await unwrap(client.GET("/api/station/ready-patients"))).items,
  session: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}", { params: { path: { session_id: key } } })),
  createSession: (body: Schemas["SessionCreate"]) => unwrap(client.POST("/api/sessions", { body })),
  updateSession: (key: string, body: Schemas["SessionUpdate"]) =>
    // `keepalive` lets a note arrive although the page is closing. Browsers allow it for up to 64 kB.
    unwrap(
      client.PATCH("/api/sessions/{session_id}", {
        params: { path: { session_id: key } },
        body,
        keepalive: (body.note?.length ?? 0) < 16_000,
      }),
    ),
  endSession: (key: string, body: Schemas["SessionEnd"] = {}) =>
    unwrap(client.POST("/api/sessions/{session_id}/end", { params: { path: { session_id: key } }, body })),
  // Session wizard
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
  sessionAlarms: (session_id: string) =>
    unwrap(client.GET("/api/events", { params: { query: { session_id, kind: "alarm", limit: 50 } } })),
  runFigures: (key: string, window: PlotWindow | null) =>
    unwrap(
      client.GET("/api/runs/{run_id}/figures", { params: { path: { run_id: key }, query: window ?? {} } }),
    ),
  teachingChecklist: (patient_id: string, fixtures: Schemas["TeachRequest"]["fixtures"]) =>
    unwrap(
      client.GET("/api/patients/{patient_id}/teaching-checklist", {
        params: { path: { patient_id }, query: { fixtures } },
      }),
    ),
  teach: (body: Schemas["TeachRequest"]) => unwrap(client.POST("/api/station/teach", { body })),
  // Programmes
  programmes: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/programmes", { params: { path: { patient_id: key } } })),
  createProgramme: (key: string, body: Schemas["ProgrammeCreate"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/programmes", { params: { path: { patient_id: key } }, body }),
    ),
  previewProgramme: (key: string, body: Schemas["PreviewWanted"]) =>
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
  sessionPlan: (key: string) =>
    unwrap(client.GET("/api/sessions/{session_id}/plan", { params: { path: { session_id: key } } })),
  adherence: (key: string, utc_offset_minutes: number) =>
    unwrap(
      client.GET("/api/episodes/{episode_id}/adherence", {
        params: { path: { episode_id: key }, query: { utc_offset_minutes } },
      }),
    ),
  takeLease: (take_over: boolean) => unwrap(client.POST("/api/station/lease", { body: { take_over } })),
  releaseLease: () => unwrap(client.DELETE("/api/station/lease")),
  load: (body: Schemas["LoadRequest"]) => unwrap(client.POST("/api/station/load", { body })),
  finishTeaching: () => unwrap(client.POST("/api/station/finish-teaching")),
  unload: () => unwrap(client.POST("/api/station/unload")),
  approach: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/approach", { body })),
  play: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/play", { body })),
  setSide: (side: Schemas["Live"]["side"]) => unwrap(client.POST("/api/station/side", { body: { side } })),
  pause: () => unwrap(client.POST("/api/station/pause")),
  reduceRange: () => unwrap(client.POST("/api/station/reduce-range")),
  returnArm: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/return", { body })),
  releaseTorque: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/release-torque", { body })),
  /** Fails after STOP_TIMEOUT_MS, because the user needs the result at once. */
  stop: () =>
    expectSuccess(client.POST("/api/station/stop", { signal: AbortSignal.timeout(STOP_TIMEOUT_MS) })),
  acknowledge: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/acknowledge", { body })),
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
  // Import, export and erasure. Files are sent as bytes; the service decodes them.
  previewMotion: (patient_id: string, side: "left" | "right", csv: Blob) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/recordings/import/preview", {
        params: { path: { patient_id }, query: { side } },
        body: "",
        headers: { "Content-Type": "text/csv" },
        bodySerializer: () => csv,
      }),
    ),
  importMotion: (
    patient_id: string,
    query: { name: string; side: "left" | "right"; taught_by: string },
    csv: Blob,
  ) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/recordings/import", {
        params: { path: { patient_id }, query },
        body: "",
        headers: { "Content-Type": "text/csv" },
        bodySerializer: () => csv,
      }),
    ),
  importPatients: (affected_side: "left" | "right", resource: Blob) =>
    unwrap(
      client.POST("/api/patients/import/fhir", {
        params: { query: { affected_side } },
        body: {},
        headers: { "Content-Type": "application/fhir+json" },
        bodySerializer: () => resource,
      }),
    ),
  openErasures: () => unwrap(client.GET("/api/erasures")),
  erasures: (patient_id: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/erasures", { params: { path: { patient_id } } })),
  requestErasure: (patient_id: string, body: Schemas["ErasureRequest"]) =>
    unwrap(client.POST("/api/patients/{patient_id}/erasures", { params: { path: { patient_id } }, body })),
  refuseErasure: (erasure_id: string, body: Schemas["ErasureRefusal"]) =>
    unwrap(client.POST("/api/erasures/{erasure_id}/refuse", { params: { path: { erasure_id } }, body })),
  erasePatient: (erasure_id: string, body: Schemas["ErasureConsent"]) =>
    unwrap(client.POST("/api/erasures/{erasure_id}/approve", { params: { path: { erasure_id } }, body })),
};
