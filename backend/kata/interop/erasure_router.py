"""Routes of requests for erasure."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.restricted import service as restricted
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.interop import erasures
from kata.interop.schemas import Erasure, ErasureConsent, ErasureRefusal, ErasureRequest
from kata.pagination import Page

router = APIRouter(tags=["erasures"])


@router.get("/api/erasures", summary="List undecided requests for erasure")
def list_erasures(database: TheDatabase, actor: TheActor) -> Page[Erasure]:
    """Return the undecided requests of patients whose records you may open, oldest first. The requests are few, so the list has no
    pages.
    """
    with database.read() as session:
        rows = erasures.undecided(session, restricted.hidden(actor))
        return Page[Erasure].complete([Erasure.model_validate(row) for row in rows])


@router.get(
    "/api/patients/{patient_id}/erasures",
    summary="List a patient's requests for erasure",
    responses=PROBLEMS.of(404, 422),
)
def list_patient_erasures(database: TheDatabase, patient_id: UUID) -> Page[Erasure]:
    """Return a patient's requests for erasure with their decisions, oldest first. Only one can be open at a time, so the list has no
    pages.
    """
    with database.read() as session:
        rows = erasures.of_patient(session, patient_id)
        return Page[Erasure].complete([Erasure.model_validate(row) for row in rows])


@router.post(
    "/api/patients/{patient_id}/erasures",
    summary="Record a request for erasure",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def request_erasure(database: TheDatabase, patient_id: UUID, erasure_request: ErasureRequest) -> Erasure:
    """Record that a patient requests the erasure of the record. Nothing is erased yet."""
    with database.write() as session:
        return Erasure.model_validate(erasures.request(session, patient_id, erasure_request))


@router.post(
    "/api/erasures/{erasure_id}/refuse", summary="Refuse a request for erasure", responses=PROBLEMS.of(404, 409, 422)
)
def refuse_erasure(database: TheDatabase, erasure_id: UUID, refusal: ErasureRefusal) -> Erasure:
    """Refuse a request for erasure, with the reason."""
    with database.write() as session:
        return Erasure.model_validate(erasures.refuse(session, erasure_id, refusal))


@router.post(
    "/api/erasures/{erasure_id}/approve",
    summary="Approve a request and erase the patient",
    responses=PROBLEMS.of(404, 409, 422),
)
def approve_erasure(database: TheDatabase, erasure_id: UUID, consent: ErasureConsent) -> Erasure:
    """Approve a request for erasure and erase the patient's identifying data permanently. Motions and measurements remain without a
    person.
    """
    with database.write() as session:
        return Erasure.model_validate(erasures.erase(session, erasure_id, consent))
