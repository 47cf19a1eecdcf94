"""REST routes of the patient's mode."""

from uuid import UUID

from fastapi import APIRouter

from kata.auth.login import TheActor, TheAuthentication
from kata.clinic.patient_mode import service
from kata.clinic.patient_mode.schemas import PatientAnswers, PatientModeStart, PatientQuestionnaire
from kata.dependencies import PROBLEMS, TheDatabase

router = APIRouter(tags=["questionnaires"])


@router.post(
    "/api/episodes/{episode_id}/patient-mode",
    status_code=204,
    summary="Hand this browser to the patient",
    responses=PROBLEMS.of(404, 409, 422),
)
def start_patient_mode(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, episode_id: UUID, body: PatientModeStart
) -> None:
    """Lock the screen of this browser and show a questionnaire to the patient. Unlocking the screen ends the patient's mode."""
    with database.write() as session:
        service.start(session, actor, episode_id, body, auth.now())


@router.get("/api/me/questionnaire", summary="Get the patient's questionnaire")
def get_patient_questionnaire(database: TheDatabase, actor: TheActor) -> PatientQuestionnaire | None:
    """Return the questionnaire that the patient fills in on this browser while the screen is locked, or null if there is none."""
    with database.read() as session:
        return service.present(session, actor)


@router.put("/api/me/questionnaire", summary="Answer the patient's questionnaire", responses=PROBLEMS.of(404, 409, 422))
def answer_patient_questionnaire(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, body: PatientAnswers
) -> PatientQuestionnaire:
    """Store the patient's answers so far. When the patient has finished, store them as an assessment."""
    with database.write() as session:
        return service.answer(session, actor, body, auth.now())
