import type { PlotWindow } from "../../ui/plotWindow";
import { allPages, client, startAfter, unwrap } from "./request";
import type { Chart, Edit, Schemas } from "./types";

/** Patients, episodes of care, assessments, progress and recordings. */
export const recordsApi = {
  patients: (search: string, archived: boolean, after: string | null = null, limit?: number) =>
    unwrap(
      client.GET("/api/patients", { params: { query: { search, archived, ...startAfter(after, limit) } } }),
    ),
  patient: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}", { params: { path: { patient_id: key } } })),
  createPatient: (body: Schemas["PatientCreate"]) => unwrap(client.POST("/api/patients", { body })),
  updatePatient: (key: string, body: Schemas["PatientUpdate"]) =>
    unwrap(client.PATCH("/api/patients/{patient_id}", { params: { path: { patient_id: key } }, body })),
  patientBanner: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/banner", { params: { path: { patient_id: key } } })),
  contraindicationKinds: () => unwrap(client.GET("/api/contraindication-kinds")),
  contraindications: (key: string) =>
    unwrap(
      client.GET("/api/patients/{patient_id}/contraindications", { params: { path: { patient_id: key } } }),
    ),
  addContraindication: (key: string, body: Schemas["ContraindicationCreate"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/contraindications", {
        params: { path: { patient_id: key } },
        body,
      }),
    ),
  signOffContraindication: (key: string, body: Schemas["SignOff"]) =>
    unwrap(
      client.POST("/api/contraindications/{contraindication_id}/sign-off", {
        params: { path: { contraindication_id: key } },
        body,
      }),
    ),
  resolveContraindication: (key: string, body: Schemas["Resolution"]) =>
    unwrap(
      client.POST("/api/contraindications/{contraindication_id}/resolve", {
        params: { path: { contraindication_id: key } },
        body,
      }),
    ),
  episode: (key: string) =>
    unwrap(client.GET("/api/episodes/{episode_id}", { params: { path: { episode_id: key } } })),
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
  progress: (key: string, chart: Chart, columns: number) =>
    unwrap(
      client.GET("/api/episodes/{episode_id}/progress/{chart}", {
        params: { path: { episode_id: key, chart }, query: { columns } },
      }),
    ),
  adherence: (key: string) =>
    unwrap(client.GET("/api/episodes/{episode_id}/adherence", { params: { path: { episode_id: key } } })),
  /** Fetches all pages, because lists for choosing show every recording. */
  recordings: (key: string) =>
    allPages((after) =>
      unwrap(
        client.GET("/api/patients/{patient_id}/recordings", {
          params: { path: { patient_id: key }, query: { limit: 200, ...startAfter(after) } },
        }),
      ),
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
  soundRhythm: (key: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/sound-rhythm", { params: { path: { patient_id: key } } })),
  recordingRhythm: (key: string) =>
    unwrap(client.GET("/api/recordings/{recording_id}/rhythm", { params: { path: { recording_id: key } } })),
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
};
