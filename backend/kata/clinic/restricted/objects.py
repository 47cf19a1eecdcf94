"""Whose record a thing belongs to: every id that a request can name, and the way from it to the patient."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients.tables import ErasureRow, PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.tables import RunRow, SessionRow

_Owner = Select[UUID]

OF_A_PATIENT: Final[Mapping[str, Callable[[UUID], _Owner]]] = MappingProxyType(
    {
        "patient_id": lambda one: select(PatientRow.id).where(PatientRow.id == one),
        "erasure_id": lambda one: select(ErasureRow.patient_id).where(ErasureRow.id == one),
        "episode_id": lambda one: select(EpisodeRow.patient_id).where(EpisodeRow.id == one),
        "stage_id": lambda one: _of_episode(StageRow.episode_id, StageRow.id == one),
        "assessment_id": lambda one: _of_episode(AssessmentRow.episode_id, AssessmentRow.id == one),
        "programme_id": lambda one: _of_episode(ProgrammeRow.episode_id, ProgrammeRow.id == one),
        "programme_version_id": lambda one: _of_episode(
            ProgrammeRow.episode_id,
            ProgrammeRow.id
            == select(ProgrammeVersionRow.programme_id).where(ProgrammeVersionRow.id == one).scalar_subquery(),
        ),
        "recording_id": lambda one: select(RecordingRow.patient_id).where(RecordingRow.id == one),
        "session_id": lambda one: select(SessionRow.patient_id).where(SessionRow.id == one),
        "run_id": lambda one: (
            select(SessionRow.patient_id).join(RunRow, RunRow.session_id == SessionRow.id).where(RunRow.id == one)
        ),
    }
)
"""By the name that an id has in paths, queries and bodies."""
OF_NOBODY: Final = frozenset({"account_id", "account_ids", "backup_id", "glass_id", "sign_in_id"})
"""Ids that lead to no patient's record."""


def patients_of(session: Session, named: Iterable[tuple[str, UUID]]) -> list[UUID]:
    """The patients whose records these belong to, in their order, each once; none for what is not there."""
    found: dict[UUID, None] = {}
    for name, one in named:
        owner = session.scalars(OF_A_PATIENT[name](one)).first()
        if owner is not None:
            found[owner] = None
    return list(found)


def _of_episode(column: Any, condition: Any) -> _Owner:
    return select(EpisodeRow.patient_id).join_from(EpisodeRow, column.class_, EpisodeRow.id == column).where(condition)
