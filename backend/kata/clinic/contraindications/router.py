"""REST routes of contraindications."""

from contextlib import suppress
from uuid import UUID

from fastapi import APIRouter

from kata.clinic import banner
from kata.clinic.contraindications import service
from kata.clinic.contraindications.schemas import (
    Contraindication,
    ContraindicationCreate,
    ContraindicationKind,
    Resolution,
    SignOff,
)
from kata.clinic.patients import service as patients
from kata.clinic.sessions import checks
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.router import TheOfflineCache
from kata.database.availability import DatabaseUnavailableError
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import Page

router = APIRouter(tags=["contraindications"])


@router.get("/api/contraindication-kinds", summary="List the kinds of contraindications")
def list_contraindication_kinds() -> Page[ContraindicationKind]:
    """Return every kind with its effect and the source of the effect. The list has no pages."""
    return Page[ContraindicationKind].complete(service.kinds())


@router.get(
    "/api/patients/{patient_id}/contraindications",
    summary="List a patient's contraindications",
    responses=PROBLEMS.of(404, 422),
)
def list_contraindications(database: TheDatabase, patient_id: UUID) -> Page[Contraindication]:
    """Return all contraindications, including resolved ones, oldest first. A patient has few, so the list has no pages."""
    with database.read() as session:
        return Page[Contraindication].complete(service.of_patient(session, patient_id))


@router.post(
    "/api/patients/{patient_id}/contraindications",
    summary="Record a contraindication",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def add_contraindication(
    database: TheDatabase, offline_cache: TheOfflineCache, patient_id: UUID, body: ContraindicationCreate
) -> Contraindication:
    """Record a contraindication. It takes effect at the next teaching, load, approach or play.

    A running playback that it forbids is paused with the arm held: at this station within a second, at another one within about eleven
    seconds. An approach, a return and teaching continue.
    """
    with database.write() as session:
        added = service.add(session, patient_id, body)
    _show_at_station(database, offline_cache, patient_id)
    return added


@router.post(
    "/api/contraindications/{contraindication_id}/sign-off",
    summary="Record a doctor's permission",
    responses=PROBLEMS.of(404, 409, 422),
)
def sign_off_contraindication(
    database: TheDatabase, offline_cache: TheOfflineCache, contraindication_id: UUID, body: SignOff
) -> Contraindication:
    """Record that a doctor allows the treatment in spite of a contraindication. A second permission is refused, and the first one stays."""
    with database.write() as session:
        changed = service.sign_off(session, contraindication_id, body)
    _show_at_station(database, offline_cache, changed.patient_id)
    return changed


@router.post(
    "/api/contraindications/{contraindication_id}/resolve",
    summary="Resolve a contraindication",
    responses=PROBLEMS.of(404, 409, 422),
)
def resolve_contraindication(
    database: TheDatabase, offline_cache: TheOfflineCache, contraindication_id: UUID, body: Resolution
) -> Contraindication:
    """Record why a contraindication no longer applies. It stays in the record."""
    with database.write() as session:
        changed = service.resolve(session, contraindication_id, body)
    _show_at_station(database, offline_cache, changed.patient_id)
    return changed


def _show_at_station(database: Database, offline_cache: OfflineCache, patient_id: UUID) -> None:
    """Check the next motion at this station against the changed record."""
    with suppress(DatabaseUnavailableError), database.read() as session:
        today = checks.today(offline_cache.zone).date()
        offline_cache.replace_banner(banner.of_patient(session, patients.get(session, patient_id), today))
