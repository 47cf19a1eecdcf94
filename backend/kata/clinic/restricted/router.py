"""REST routes of restricted records and break-glass accesses."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.restricted import service
from kata.clinic.restricted.schemas import (
    BreakGlass,
    BreakGlassAccess,
    RecordAccess,
    RecordAccessChange,
)
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.pagination import After, Limit, Page

router = APIRouter(tags=["restricted records"])


@router.get("/api/patients/{patient_id}/access", summary="Get who may see a record", responses=PROBLEMS.of(404, 422))
def get_record_access(database: TheDatabase, actor: TheActor, patient_id: UUID) -> RecordAccess:
    """Return who may see a patient's record, and whether you may see it."""
    with database.read() as session:
        return service.access(session, actor, patient_id)


@router.put("/api/patients/{patient_id}/access", summary="Restrict or open a record", responses=PROBLEMS.of(404, 422))
def change_record_access(
    database: TheDatabase, actor: TheActor, patient_id: UUID, body: RecordAccessChange
) -> RecordAccess:
    """Restrict a record to a care team, or open it to all users who may read records."""
    with database.write() as session:
        service.change(session, patient_id, body)
        return service.access(session, actor, patient_id)


@router.post(
    "/api/patients/{patient_id}/break-glass-accesses",
    summary="Open a restricted record in an emergency",
    responses=PROBLEMS.of(404, 409, 422),
)
def break_glass(database: TheDatabase, actor: TheActor, patient_id: UUID, body: BreakGlass) -> RecordAccess:
    """Open a restricted record for four hours in an emergency. Administrators see the access and its reason."""
    with database.write() as session:
        service.create_break_glass_access(session, actor, patient_id, body.reason)
        return service.access(session, actor, patient_id)


@router.get("/api/break-glass-accesses", summary="List break-glass accesses", responses=PROBLEMS.of(422))
def list_break_glass_accesses(database: TheDatabase, limit: Limit = 50, after: After = None) -> Page[BreakGlassAccess]:
    """Return the break-glass accesses, unreviewed ones first, then newest first."""
    with database.read() as session:
        items, further = service.break_glass_accesses(session, limit, after)
        return Page[BreakGlassAccess](items=items, next=further)


# ``glass_id`` is the id of the break-glass access. The public path keeps this name.
@router.post(
    "/api/break-glass-accesses/{glass_id}/review",
    summary="Review a break-glass access",
    responses=PROBLEMS.of(404, 409, 422),
)
def review_break_glass_access(database: TheDatabase, actor: TheActor, glass_id: UUID) -> BreakGlassAccess:
    """Mark a break-glass access as reviewed. You cannot review your own access."""
    with database.write() as session:
        return service.review_break_glass_access(session, actor, glass_id)
