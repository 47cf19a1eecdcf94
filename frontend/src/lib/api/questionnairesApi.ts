import { client, expectSuccess, unwrap } from "./request";
import type { Schemas } from "./types";

/** Questionnaires and the patient's mode. */
export const questionnairesApi = {
  questionnaires: () => unwrap(client.GET("/api/questionnaires")),
  startPatientMode: (episodeId: string, body: Schemas["PatientModeStart"]) =>
    expectSuccess(
      client.POST("/api/episodes/{episode_id}/patient-mode", {
        params: { path: { episode_id: episodeId } },
        body,
      }),
    ),
  patientQuestionnaire: () => unwrap(client.GET("/api/me/questionnaire")),
  answerQuestionnaire: (body: Schemas["PatientAnswers"]) =>
    unwrap(client.PUT("/api/me/questionnaire", { body })),
};
