"""REST for requests for erasure."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.restricted import service as restricted
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.interop import erasures
from kata.interop.schemas import Erasure, ErasureConsent, ErasureList, ErasureRefusal, ErasureRequest

router = APIRouter(tags=["erasures"])


@router.get("/api/erasures")
def list_erasures(database: TheDatabase, actor: TheActor) -> ErasureList:
    """Requests that nobody has decided yet, oldest first; of patients whose records are open to you."""
    with database.read() as session:
        rows = erasures.undecided(session, restricted.hidden(actor))
        return ErasureList(items=[Erasure.model_validate(row) for row in rows])


@router.get("/api/patients/{patient_id}/erasures", responses=PROBLEMS.of(404, 422))
def list_patient_erasures(database: TheDatabase, patient_id: UUID) -> ErasureList:
    """A patient's requests, and what was decided."""
    with database.read() as session:
        return ErasureList(items=[Erasure.model_validate(row) for row in erasures.of_patient(session, patient_id)])


@router.post("/api/patients/{patient_id}/erasures", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def request_erasure(database: TheDatabase, patient_id: UUID, asked: ErasureRequest) -> Erasure:
    """Note that a patient asks for the record to be erased. Nothing is erased by that."""
    with database.write() as session:
        return Erasure.model_validate(erasures.note(session, patient_id, asked))


@router.post("/api/erasures/{erasure_id}/refuse", responses=PROBLEMS.of(404, 409, 422))
def refuse_erasure(database: TheDatabase, erasure_id: UUID, refusal: ErasureRefusal) -> Erasure:
    """Keep the record, and say why: a duty to keep it, say."""
    with database.write() as session:
        return Erasure.model_validate(erasures.refuse(session, erasure_id, refusal))


@router.post("/api/erasures/{erasure_id}/approve", responses=PROBLEMS.of(404, 409, 422))
def approve_erasure(database: TheDatabase, erasure_id: UUID, consent: ErasureConsent) -> Erasure:
    """Take away what tells who the patient is, for good; what the shoulder did stays, without a person."""
    with database.write() as session:
        return Erasure.model_validate(erasures.erase(session, erasure_id, consent))
