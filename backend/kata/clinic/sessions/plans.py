"""The plan of a session: a version of one of the patient's programmes, or none. The caller commits."""

from collections.abc import Iterable
from uuid import UUID

from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeVersionRow
from kata.clinic.sessions.schemas import EndRangePrescription, SessionItem, SessionProgramme
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.errors import ProblemError, not_found


def choose(session: DatabaseSession, row: SessionRow, version_id: UUID) -> None:
    """Set a version of a programme as the session's plan.

    :raises ProblemError: 404; 409 when the version does not belong to the patient's open episode.
    """
    version = session.get(ProgrammeVersionRow, version_id)
    if version is None:
        raise not_found(texts.PROGRAMME_NOT_FOUND)
    episode = row.patient.episode
    if episode is None or episode.closed_at or version.programme.episode_id != episode.id:
        raise ProblemError(
            409,
            "other_episode",
            texts.PROGRAMME_OF_OTHER_EPISODE(),
            texts.CHOOSE_OWN_PROGRAMME(),
        )
    row.programme_version = version


def require(row: SessionRow, position: int, recording_id: UUID) -> None:
    """Check that the plan contains the recording at this position.

    :raises ProblemError: 409.
    """
    check_place([(item.position, item.recording_id) for item in items(row)], position, recording_id)


def check_place(planned_items: Iterable[tuple[int, UUID]], position: int, recording_id: UUID) -> None:
    """Check that ``planned_items`` contains the recording at this position.

    :raises ProblemError: 409.
    """
    if (position, recording_id) not in planned_items:
        raise ProblemError(
            409,
            "not_planned",
            texts.RECORDING_NOT_AT_PLACE(),
            texts.RELOAD_SESSION(),
        )


def items(row: SessionRow) -> list[SessionItem]:
    """Return the planned items in order; empty if recordings are chosen one by one."""
    return of_version(row.programme_version) if row.programme_version else []


def of_version(version: ProgrammeVersionRow) -> list[SessionItem]:
    """Return a version's items in order."""
    return [
        SessionItem(
            position=item.position,
            recording_id=item.recording_id,
            recording_name=item.recording.name,
            speed_percent=item.speed_percent,
            repetitions=item.repetitions,
            pause_s=item.pause_s,
            range_percent=item.range_percent,
            resistance_level=item.resistance_level,
            method=item.method,
            end_range=item.end_range,
            self_paced=item.self_paced,
        )
        for item in version.items
    ]


def end_range_of(session: DatabaseSession, run: RunRow) -> EndRangePrescription | None:
    """Return the end-range time that the session's programme prescribes for a run, or None."""
    version_id = session.get_one(SessionRow, run.session_id).programme_version_id
    if version_id is None or run.programme_position is None:
        return None
    item = session.get(ProgrammeItemRow, (version_id, run.programme_position))
    if item is None or item.recording_id != run.recording_id or item.end_range is None:
        return None
    return EndRangePrescription.model_validate(item.end_range)


def as_programme(row: SessionRow) -> SessionProgramme | None:
    """Return the response model of the session's plan, or None without a plan."""
    return programme_of(row.programme_version) if row.programme_version else None


def programme_of(version: ProgrammeVersionRow) -> SessionProgramme:
    """Return the response model of a session that is planned by this version."""
    return SessionProgramme(
        id=version.programme.id,
        name=version.programme.name,
        version_id=version.id,
        number=version.number,
        timer_minutes=version.timer_minutes,
        items=of_version(version),
    )
