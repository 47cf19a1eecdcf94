"""REST routes of patients."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query

from kata.clinic.patients import service
from kata.clinic.patients.schemas import Patient, PatientCreate, PatientUpdate
from kata.clinic.restricted import service as restricted
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.pagination import After, Limit, Page
from kata.types import NO_NUL

router = APIRouter(prefix="/api/patients", tags=["patients"])


@router.get("", summary="List or search patients", responses=PROBLEMS.of(422))
def list_patients(
    database: TheDatabase,
    actor: TheActor,
    search: Annotated[
        str,
        Query(
            max_length=100,
            pattern=NO_NUL,
            description="Parts of name, kana or clinic number, and of the birth date (1968, 1968-04, 1968-04-12). Every word must "
            "be found; case, width, accents and the kind of kana make no difference.",
            examples=["yamada 1968"],
        ),
    ] = "",
    archived: Annotated[bool, Query(description="True returns archived patients instead of current ones.")] = False,
    limit: Limit = 50,
    after: After = None,
) -> Page[Patient]:
    """Return patients in the order of their names: Latin names by letter, other names by their reading in kana.

    A restricted record that you may not see is found only by its complete clinic number, and shows only number and name.
    """
    with database.read() as session:
        without = restricted.hidden(actor)
        rows, further = service.find(
            session, search=search, archived=archived, limit=limit, after=after, hidden=without
        )
        hidden = restricted.hidden_among(session, actor, (row.id for row in rows if row.restricted))
        items = [Patient.model_validate(row) for row in rows]
        return Page[Patient](
            items=[item.without_record() if item.id in hidden else item for item in items], next=further
        )


@router.post("", summary="Register a patient", status_code=201, responses=PROBLEMS.of(409, 422))
def create_patient(database: TheDatabase, patient: PatientCreate) -> Patient:
    """Register a patient."""
    with database.write() as session:
        row = service.create(session, patient)
    return Patient.model_validate(row)


@router.get("/{patient_id}", summary="Get a patient", responses=PROBLEMS.of(404, 422))
def get_patient(database: TheDatabase, patient_id: UUID) -> Patient:
    """Return one patient."""
    with database.read() as session:
        return Patient.model_validate(service.get(session, patient_id))


@router.patch("/{patient_id}", summary="Change, archive or restore a patient", responses=PROBLEMS.of(404, 409, 422))
def update_patient(database: TheDatabase, patient_id: UUID, change: PatientUpdate) -> Patient:
    """Change a patient's record, or archive or restore it."""
    with database.write() as session:
        row = service.update(session, patient_id, change)
    return Patient.model_validate(row)
