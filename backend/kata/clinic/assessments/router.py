"""REST for assessments."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.assessments import service
from kata.clinic.assessments.schemas import (
    Assessment,
    AssessmentCreate,
    AssessmentForm,
    AssessmentPage,
    AssessmentUpdate,
    AssessmentWithdraw,
    EpisodeAssessments,
)
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import After, Limit

router = APIRouter(tags=["assessments"])


@router.get("/api/assessments/form")
def get_assessment_form() -> AssessmentForm:
    """What may be measured and asked: motions with what is plausible and usual of them, and the items of the SPADI."""
    return service.form()


@router.get("/api/episodes/{episode_id}/assessments", responses=PROBLEMS.of(404, 422))
def list_assessments(
    database: TheDatabase, episode_id: UUID, limit: Limit = 50, after: After = None
) -> EpisodeAssessments:
    """An episode's assessments, newest first, withdrawn ones among them; and the first, which others are held against."""
    with database.read() as session:
        rows, further, first = service.of_episode(session, episode_id, limit, after)
        return EpisodeAssessments(
            items=[service.as_assessment(row) for row in rows],
            next=further,
            baseline=service.as_assessment(first) if first else None,
        )


@router.get("/api/patients/{patient_id}/assessments", responses=PROBLEMS.of(404, 422))
def list_patient_assessments(
    database: TheDatabase, patient_id: UUID, limit: Limit = 50, after: After = None
) -> AssessmentPage:
    """The assessments of all of a patient's episodes, newest first."""
    with database.read() as session:
        rows, further = service.of_patient(session, patient_id, limit, after)
        return AssessmentPage(items=[service.as_assessment(row) for row in rows], next=further)


@router.post("/api/episodes/{episode_id}/assessments", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def create_assessment(database: TheDatabase, episode_id: UUID, found: AssessmentCreate) -> Assessment:
    """Keep what was found."""
    with database.write() as session:
        return service.as_assessment(service.create(session, episode_id, found))


@router.get("/api/assessments/{assessment_id}", responses=PROBLEMS.of(404, 422))
def get_assessment(database: TheDatabase, assessment_id: UUID) -> Assessment:
    """One assessment."""
    with database.read() as session:
        return service.as_assessment(service.get(session, assessment_id))


@router.patch("/api/assessments/{assessment_id}", responses=PROBLEMS.of(404, 409, 422))
def update_assessment(database: TheDatabase, assessment_id: UUID, change: AssessmentUpdate) -> Assessment:
    """Change any part of an assessment."""
    with database.write() as session:
        return service.as_assessment(service.change(session, assessment_id, change))


@router.post("/api/assessments/{assessment_id}/withdraw", responses=PROBLEMS.of(404, 409, 422))
def withdraw_assessment(database: TheDatabase, assessment_id: UUID, seen: AssessmentWithdraw) -> Assessment:
    """Withdraw what was entered by mistake: it stays to be seen, and counts for nothing; doing so again changes nothing."""
    with database.write() as session:
        return service.as_assessment(service.withdraw(session, assessment_id, seen.updated_at))
