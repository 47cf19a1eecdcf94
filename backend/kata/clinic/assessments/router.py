"""REST routes of assessments."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.assessments import service
from kata.clinic.assessments.schemas import (
    Assessment,
    AssessmentCreate,
    AssessmentForm,
    AssessmentUpdate,
    AssessmentWithdraw,
    EpisodeAssessments,
)
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import After, Limit, Page

router = APIRouter(tags=["assessments"])


@router.get("/api/assessments/form", summary="Get the assessment form")
def get_assessment_form() -> AssessmentForm:
    """Return the content of the form: the motions with their plausible and reference angles, and the SPADI items."""
    return service.form()


@router.get(
    "/api/episodes/{episode_id}/assessments", summary="List an episode's assessments", responses=PROBLEMS.of(404, 422)
)
def list_assessments(
    database: TheDatabase, episode_id: UUID, limit: Limit = 50, after: After = None
) -> EpisodeAssessments:
    """Return an episode's assessments, newest first, including withdrawn ones. The baseline is the first assessment that was not
    withdrawn.
    """
    with database.read() as session:
        rows, further, first = service.of_episode(session, episode_id, limit, after)
        return EpisodeAssessments(
            items=[service.as_assessment(row) for row in rows],
            next=further,
            baseline=service.as_assessment(first) if first else None,
        )


@router.get(
    "/api/patients/{patient_id}/assessments", summary="List a patient's assessments", responses=PROBLEMS.of(404, 422)
)
def list_patient_assessments(
    database: TheDatabase, patient_id: UUID, limit: Limit = 50, after: After = None
) -> Page[Assessment]:
    """Return the assessments of all episodes of a patient, newest first."""
    with database.read() as session:
        rows, further = service.of_patient(session, patient_id, limit, after)
        return Page[Assessment](items=[service.as_assessment(row) for row in rows], next=further)


@router.post(
    "/api/episodes/{episode_id}/assessments",
    summary="Create an assessment",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def create_assessment(database: TheDatabase, episode_id: UUID, body: AssessmentCreate) -> Assessment:
    """Store an assessment."""
    with database.write() as session:
        return service.as_assessment(service.create(session, episode_id, body))


@router.get("/api/assessments/{assessment_id}", summary="Get an assessment", responses=PROBLEMS.of(404, 422))
def get_assessment(database: TheDatabase, assessment_id: UUID) -> Assessment:
    """Return one assessment."""
    with database.read() as session:
        return service.as_assessment(service.get(session, assessment_id))


@router.patch("/api/assessments/{assessment_id}", summary="Change an assessment", responses=PROBLEMS.of(404, 409, 422))
def update_assessment(database: TheDatabase, assessment_id: UUID, change: AssessmentUpdate) -> Assessment:
    """Change an assessment. Only the given fields change."""
    with database.write() as session:
        return service.as_assessment(service.change(session, assessment_id, change))


@router.post(
    "/api/assessments/{assessment_id}/withdraw", summary="Withdraw an assessment", responses=PROBLEMS.of(404, 409, 422)
)
def withdraw_assessment(database: TheDatabase, assessment_id: UUID, body: AssessmentWithdraw) -> Assessment:
    """Withdraw an assessment that was entered by mistake. It remains visible, but figures ignore it. A repeated call changes nothing."""
    with database.write() as session:
        return service.as_assessment(service.withdraw(session, assessment_id, body.updated_at))
