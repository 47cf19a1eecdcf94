"""Find the patient to whom a record belongs, for every id that a request can name."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients.tables import ErasureRow, PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.tables import GoniometerReadingRow, RunRow, SessionRow

_Owner = Select[UUID]

PATIENT_QUERY_BY_ID_NAME: Final[Mapping[str, Callable[[UUID], _Owner]]] = MappingProxyType(
    {
        "patient_id": lambda id_: select(PatientRow.id).where(PatientRow.id == id_),
        "erasure_id": lambda id_: select(ErasureRow.patient_id).where(ErasureRow.id == id_),
        "contraindication_id": lambda id_: select(ContraindicationRow.patient_id).where(ContraindicationRow.id == id_),
        "episode_id": lambda id_: select(EpisodeRow.patient_id).where(EpisodeRow.id == id_),
        "stage_id": lambda id_: _of_episode(StageRow.episode_id, StageRow.id == id_),
        "assessment_id": lambda id_: _of_episode(AssessmentRow.episode_id, AssessmentRow.id == id_),
        "programme_id": lambda id_: _of_episode(ProgrammeRow.episode_id, ProgrammeRow.id == id_),
        "programme_version_id": lambda id_: _of_episode(
            ProgrammeRow.episode_id,
            ProgrammeRow.id
            == select(ProgrammeVersionRow.programme_id).where(ProgrammeVersionRow.id == id_).scalar_subquery(),
        ),
        "reading_id": lambda id_: (
            select(SessionRow.patient_id)
            .join(GoniometerReadingRow, GoniometerReadingRow.session_id == SessionRow.id)
            .where(GoniometerReadingRow.id == id_)
        ),
        "recording_id": lambda id_: select(RecordingRow.patient_id).where(RecordingRow.id == id_),
        "session_id": lambda id_: select(SessionRow.patient_id).where(SessionRow.id == id_),
        "run_id": lambda id_: (
            select(SessionRow.patient_id).join(RunRow, RunRow.session_id == SessionRow.id).where(RunRow.id == id_)
        ),
    }
)
"""Query of the owner by the id's name in paths, queries and bodies."""
WITHOUT_PATIENT: Final = frozenset(
    {
        "access_token_id", "account_id", "account_ids", "backup_id", "commissioning_id", "glass_id", "notification_ids",
        "sign_in_id",
    }
)  # fmt: skip
"""Ids of records that belong to no patient."""


def patients_of(session: Session, records: Iterable[tuple[str, UUID]]) -> list[UUID]:
    """Return the patients to whom these records belong, in order, each once. Unknown ids are ignored."""
    patients: dict[UUID, None] = {}
    for name, id_ in records:
        owner = session.scalars(PATIENT_QUERY_BY_ID_NAME[name](id_)).first()
        if owner is not None:
            patients[owner] = None
    return list(patients)


def _of_episode(column: Any, condition: Any) -> _Owner:
    return select(EpisodeRow.patient_id).join_from(EpisodeRow, column.class_, EpisodeRow.id == column).where(condition)
