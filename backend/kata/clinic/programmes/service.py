"""Read and write programmes. The caller commits."""

from collections.abc import Iterable, Sequence
from uuid import UUID, uuid4

from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, aliased, contains_eager

from kata.clinic import texts
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.programmes import checks
from kata.clinic.programmes.schemas import (
    Programme,
    ProgrammeCreate,
    ProgrammeDetail,
    ProgrammeItem,
    ProgrammePatient,
    ProgrammeUpdate,
    ProgrammeVersion,
    VersionCreate,
    VersionFields,
)
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, edited_meanwhile, not_found


def of_patient(session: Session, patient_id: UUID) -> list[ProgrammeVersionRow]:
    """Return the newest version of each of a patient's programmes, the last changed first and archived ones last.

    :raises ProblemError: 404.
    """
    patients.get(session, patient_id)
    return of_patients(session, [patient_id])


def of_patients(session: Session, patient_ids: Iterable[UUID]) -> list[ProgrammeVersionRow]:
    """Return the newest version of each programme of these patients, in the order of :func:`of_patient`."""
    other = aliased(ProgrammeVersionRow)
    newest = select(func.max(other.number)).where(other.programme_id == ProgrammeRow.id).scalar_subquery()
    query = (
        select(ProgrammeVersionRow)
        .join(ProgrammeVersionRow.programme)
        .join(ProgrammeRow.episode)
        .where(EpisodeRow.patient_id.in_(patient_ids), ProgrammeVersionRow.number == newest)
        .options(contains_eager(ProgrammeVersionRow.programme).contains_eager(ProgrammeRow.episode))
        .order_by(ProgrammeRow.archived_at.is_not(None), ProgrammeRow.updated_at.desc(), ProgrammeRow.id)
    )
    return list(session.scalars(query))


def get(session: Session, programme_id: UUID) -> ProgrammeRow:
    """Return one programme.

    :raises ProblemError: 404.
    """
    row = session.get(ProgrammeRow, programme_id)
    if row is None:
        raise not_found(texts.PROGRAMME_NOT_FOUND)
    return row


def open_episode(session: Session, patient_id: UUID, episode_id: UUID | None = None) -> EpisodeRow:
    """Return the episode for a new programme: the one with the given id, else the open one.

    :raises ProblemError: 404; 409 when the patient is archived, or the episode does not exist or is closed.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", texts.PATIENT_ARCHIVED(patient=patient.name), texts.RESTORE_PATIENT_FIRST())
    if episode_id is None:
        episode = patient.episode
        if episode is None:
            raise ProblemError(409, "no_episode", texts.NO_EPISODE(), texts.OPEN_ONE_FIRST())
    else:
        episode = next((row for row in patient.episodes if row.id == episode_id), None)
        if episode is None:
            raise not_found(texts.EPISODE_OF_PATIENT_NOT_FOUND)
    return _still_open(episode)


def changeable(session: Session, programme_id: UUID) -> ProgrammeRow:
    """Return a programme that accepts a new version.

    :raises ProblemError: 404; 409 when the programme or its patient is archived, or the episode is closed.
    """
    row = get(session, programme_id)
    if row.archived_at:
        raise ProblemError(409, "archived", texts.PROGRAMME_ARCHIVED(programme=row.name), texts.RESTORE_FIRST())
    open_episode(session, row.episode.patient_id, row.episode_id)
    return row


def create(session: Session, patient_id: UUID, new: ProgrammeCreate, durations_s: Sequence[float]) -> ProgrammeRow:
    """Store a programme with its first version. ``durations_s``: the checked durations of its items.

    :raises ProblemError: as in :func:`open_episode`, and when a recording does not fit the episode.
    """
    episode = open_episode(session, patient_id, new.episode_id)
    now = utc_now()
    row = ProgrammeRow(
        id=uuid4(), episode_id=episode.id, episode=episode, name=new.name, created_at=now, updated_at=now
    )
    session.add(row)
    session.flush()
    _add_version(session, row, 1, new, durations_s)
    return row


def add_version(
    session: Session, programme_id: UUID, version: VersionCreate, durations_s: Sequence[float]
) -> ProgrammeRow:
    """Store a new version. Older versions are kept.

    :raises ProblemError: as in :func:`changeable`, when a recording does not fit the episode, and 409 when a newer version exists.
    """
    row = changeable(session, programme_id)
    if newest_number(session, row.id) != version.based_on:
        raise edited_meanwhile()
    row.updated_at = utc_now()
    _add_version(session, row, version.based_on + 1, version, durations_s)
    return row


def newest_number(session: Session, programme_id: UUID) -> int | None:
    """Return the number of the newest version, or None if there is no such programme."""
    return session.scalar(
        select(func.max(ProgrammeVersionRow.number)).where(ProgrammeVersionRow.programme_id == programme_id)
    )


def update(session: Session, programme_id: UUID, change: ProgrammeUpdate) -> ProgrammeRow:
    """Rename, archive or restore a programme.

    :raises ProblemError: 404; 409 when the programme was changed meanwhile.
    """
    row = get(session, programme_id)
    patients.check_not_erased(patients.get(session, row.episode.patient_id))
    check_version(row.updated_at, change.updated_at)
    if change.name is not None:
        row.name = change.name
    if change.archived is not None:
        row.archived_at = (row.archived_at or utc_now()) if change.archived else None
    row.updated_at = utc_now()
    session.flush()
    return row


def _still_open(episode: EpisodeRow) -> EpisodeRow:
    if episode.closed_at:
        raise ProblemError(409, "episode_closed", texts.EPISODE_OF_CARE_CLOSED(), texts.OPEN_NEW_EPISODE())
    return episode


def _add_version(
    session: Session, row: ProgrammeRow, number: int, new_version: VersionFields, durations_s: Sequence[float]
) -> None:
    for problem in checks.item_problems(session, row.episode, new_version.items).values():
        raise problem
    version = ProgrammeVersionRow(
        id=uuid4(),
        programme_id=row.id,
        number=number,
        made_at=utc_now(),
        made_by=new_version.made_by,
        note=new_version.note,
        timer_minutes=new_version.timer_minutes,
        sessions_per_week=new_version.sessions_per_week,
    )
    session.add(version)
    try:
        session.flush()
    except IntegrityError as error:
        # Another request has used the same number at the same moment.
        raise edited_meanwhile() from error
    session.add_all(
        ProgrammeItemRow(version_id=version.id, position=position, duration_s=duration_s, **item.model_dump())
        for position, (item, duration_s) in enumerate(zip(new_version.items, durations_s, strict=True), start=1)
    )
    session.flush()
    session.expire(row, ["versions"])


def as_item(row: ProgrammeItemRow) -> ProgrammeItem:
    """Return the response model."""
    return ProgrammeItem(
        position=row.position,
        recording_id=row.recording_id,
        recording_name=row.recording.name,
        recording_archived=row.recording.archived_at is not None,
        duration_s=row.duration_s,
        speed_percent=row.speed_percent,
        repetitions=row.repetitions,
        pause_s=row.pause_s,
        range_percent=row.range_percent,
        resistance_level=row.resistance_level,
        method=row.method,
        end_range=row.end_range,
        self_paced=row.self_paced,
    )


def as_version(row: ProgrammeVersionRow) -> ProgrammeVersion:
    """Return the response model."""
    return ProgrammeVersion(
        id=row.id,
        number=row.number,
        made_at=row.made_at,
        made_by=row.made_by,
        note=row.note,
        timer_minutes=row.timer_minutes,
        sessions_per_week=row.sessions_per_week,
        duration_s=sum(item.duration_s for item in row.items),
        items=[as_item(item) for item in row.items],
    )


def as_programme(current: ProgrammeVersionRow) -> Programme:
    """Return the response model of a list, with the newest version."""
    row = current.programme
    return Programme(
        id=row.id,
        episode_id=row.episode_id,
        name=row.name,
        side=row.episode.side,
        archived_at=row.archived_at,
        updated_at=row.updated_at,
        current=as_version(current),
    )


def as_detail(session: Session, row: ProgrammeRow) -> ProgrammeDetail:
    """Return the response model with all versions."""
    patient = patients.get(session, row.episode.patient_id)
    versions = [as_version(version) for version in reversed(row.versions)]
    return ProgrammeDetail(
        id=row.id,
        episode_id=row.episode_id,
        name=row.name,
        side=row.episode.side,
        archived_at=row.archived_at,
        updated_at=row.updated_at,
        current=versions[0],
        patient=ProgrammePatient.model_validate(patient),
        closed=row.episode.closed_at is not None,
        versions=versions,
    )
