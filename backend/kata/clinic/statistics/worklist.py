"""The work of the day: sessions, patients who are due, unsigned notes, and changes of the therapist's patients."""

import math
from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final, Literal
from uuid import UUID

from sqlalchemy import ColumnElement, Select, bindparam, func, select, union
from sqlalchemy.orm import Session, aliased

from kata.actor import Actor
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import lists
from kata.clinic.sessions.schemas import SessionPatient
from kata.clinic.sessions.tables import SessionRow
from kata.clinic.statistics.recent_days import RecentDays
from kata.clinic.statistics.schemas import (
    LEAST_SHOWN,
    ClinicAdherence,
    DuePatient,
    PatientAdherence,
    PatientAdherences,
    PatientChange,
    ProgrammeAdherence,
    Worklist,
)
from kata.database.base import UtcDateTime

_MOST: Final = 50
_MOST_UNSIGNED: Final = 1000
_MOST_FOLLOWED: Final = 500
_CHANGED: Final = 12
"""Number of the most recent patients whose changes are shown."""
_WEEK: Final = timedelta(weeks=1)


@dataclass(frozen=True)
class FollowedProgramme:
    """A programme of an open episode with a prescribed number of sessions, and the sessions held since it was made, in the last four weeks."""

    episode_id: UUID
    patient_id: UUID
    sessions_per_week: int
    made_at: datetime
    last_session_at: datetime | None
    held: int
    patient_name: str
    clinic_number: str

    @property
    def due_at(self) -> datetime:
        """Return the time at which the next session is due. For a new programme this is at once."""
        if self.last_session_at is None:
            return self.made_at
        return self.last_session_at + _WEEK / self.sessions_per_week

    def prescribed(self, days: RecentDays) -> int:
        """Return the number of sessions prescribed in these days, or since the day on which the programme was made."""
        return days.days_since(self.made_at) * self.sessions_per_week // _WEEK.days


def worklist(session: Session, actor: Actor, days: RecentDays) -> Worklist:
    """Return the work of the last of these days for one user."""
    hidden = restricted.hidden(actor)
    due_patients, count = _due_patients(session, followed(session, days, hidden), days.until)
    visible = SessionRow.patient_id.not_in(hidden)
    mine = (SessionRow.signed_at.is_(None), SessionRow.ended_at.is_not(None), SessionRow.therapist == actor.name)
    unsigned = select(SessionRow.id).where(visible, *mine).order_by(SessionRow.started_at).limit(_MOST)
    return Worklist(
        sessions=lists.summaries(session, _of_day(visible, days.today_at), SessionRow.started_at.desc()),
        due=due_patients,
        due_count=count,
        unsigned=lists.summaries(session, unsigned, SessionRow.started_at.asc()),
        unsigned_count=_count_unsigned(session, visible),
        changes=_changes(session, actor, days.since, hidden),
    )


def _count_unsigned(session: Session, visible: ColumnElement[bool]) -> int:
    counted = select(SessionRow.id).where(visible, *lists.UNSIGNED).limit(_MOST_UNSIGNED).subquery()
    return session.scalar(select(func.count()).select_from(counted)) or 0


def followed(session: Session, days: RecentDays, hidden: Select[UUID] | None = None) -> list[FollowedProgramme]:
    """Return the newest version of each programme with a prescribed number of sessions that was made or followed in these days. Of several
    in an episode, return the newest. Archived patients are no longer expected.

    ``hidden``: query of the ids of patients to leave out.
    """
    query = _FOLLOWED if hidden is None else _FOLLOWED.where(EpisodeRow.patient_id.not_in(hidden))
    # Rows of the connection cost less than those of the session.
    rows = session.connection().execute(query, {"since": days.since}).all()
    return list({row.episode_id: FollowedProgramme(*row) for row in rows}.values())


def _followed_query() -> Select[Any]:
    """Return the query of the followed programmes since the time ``since``. Building it takes longer than running it."""
    since = bindparam("since", type_=UtcDateTime())
    held_sessions = select(SessionRow.episode_id).where(SessionRow.started_at >= since, SessionRow.run_count > 0)
    new = select(ProgrammeRow.episode_id).join(ProgrammeVersionRow).where(ProgrammeVersionRow.made_at >= since)
    among = union(held_sessions, new).subquery("among")
    other = aliased(ProgrammeVersionRow)
    newest = select(func.max(other.number)).where(other.programme_id == ProgrammeRow.id).scalar_subquery()
    of_episode = (
        SessionRow.episode_id == EpisodeRow.id,
        SessionRow.started_at >= since,
        SessionRow.run_count > 0,
    )
    last_at = select(func.max(SessionRow.started_at)).where(*of_episode).scalar_subquery()
    # Sessions are prescribed from the version's date on, so that earlier ones do not make up for them.
    count = (
        select(func.count())
        .where(*of_episode, SessionRow.started_at >= ProgrammeVersionRow.made_at)
        .correlate(EpisodeRow, ProgrammeVersionRow)
        .scalar_subquery()
    )
    return (
        select(
            ProgrammeRow.episode_id, EpisodeRow.patient_id, ProgrammeVersionRow.sessions_per_week, ProgrammeVersionRow.made_at,
            last_at, count, PatientRow.name, PatientRow.clinic_number,
        )
        .select_from(among)
        .join(EpisodeRow, EpisodeRow.id == among.c.episode_id)
        .join(PatientRow, PatientRow.id == EpisodeRow.patient_id)
        .join(ProgrammeRow, ProgrammeRow.episode_id == EpisodeRow.id)
        .join(ProgrammeVersionRow, ProgrammeVersionRow.programme_id == ProgrammeRow.id)
        .where(
            EpisodeRow.closed_at.is_(None),
            PatientRow.archived_at.is_(None),
            ProgrammeRow.archived_at.is_(None),
            ProgrammeVersionRow.number == newest,
            ProgrammeVersionRow.sessions_per_week > 0,
        )
        .order_by(ProgrammeVersionRow.made_at)
    )  # fmt: skip


_FOLLOWED: Final = _followed_query()


def clinic_adherence(session: Session, days: RecentDays) -> ClinicAdherence:
    """Return how all programmes were followed in these days, unless they are few."""
    found = adherence(followed(session, days), days)
    return ClinicAdherence(least_programmes=LEAST_SHOWN, adherence=found if found.programmes >= LEAST_SHOWN else None)


def adherence(programmes: list[FollowedProgramme], days: RecentDays) -> ProgrammeAdherence:
    """Return how these programmes were followed in these days."""
    prescribed = [programme.prescribed(days) for programme in programmes]
    return ProgrammeAdherence(
        first_day=days.first,
        last_day=days.today,
        programmes=len(programmes),
        overdue=sum(programme.due_at < days.today_at for programme in programmes),
        prescribed=sum(prescribed),
        held=sum(min(programme.held, limit) for programme, limit in zip(programmes, prescribed, strict=True)),
    )


def lowest_adherence(session: Session, actor: Actor, days: RecentDays) -> PatientAdherences:
    """Return the patients with a programme followed in these days, the lowest share of held sessions first.

    Patients whose records the actor may not see are left out. A programme without a prescribed session so far comes last.
    """
    programmes = followed(session, days, restricted.hidden(actor))
    prescribed = {programme.episode_id: programme.prescribed(days) for programme in programmes}

    def share(programme: FollowedProgramme) -> float:
        limit = prescribed[programme.episode_id]
        return min(1.0, programme.held / limit) if limit else math.inf

    listed = sorted(programmes, key=lambda programme: (share(programme), programme.due_at))[:_MOST_FOLLOWED]
    therapists = _therapists(session, listed)
    rows = [
        PatientAdherence(
            **_due(programme, therapists), prescribed=prescribed[programme.episode_id], held=programme.held
        )
        for programme in listed
    ]
    return PatientAdherences(first_day=days.first, last_day=days.today, rows=rows, count=len(programmes))


def _due_patients(
    session: Session, programmes: list[FollowedProgramme], before: datetime
) -> tuple[list[DuePatient], int]:
    """Return the first due patients and the number of all. Of several due programmes of a patient, the longest overdue counts."""
    due: dict[UUID, FollowedProgramme] = {}
    for programme in sorted(programmes, key=lambda followed_programme: followed_programme.due_at):
        if programme.due_at < before:
            due.setdefault(programme.patient_id, programme)
    first = list(due.values())[:_MOST]
    therapists = _therapists(session, first)
    return [DuePatient(**_due(programme, therapists)) for programme in first], len(due)


def _due(programme: FollowedProgramme, therapists: dict[UUID, str]) -> dict[str, Any]:
    """Return the fields of :class:`DuePatient`."""
    return {
        "patient": SessionPatient(
            id=programme.patient_id, name=programme.patient_name, clinic_number=programme.clinic_number
        ),
        "due_at": programme.due_at,
        "last_session_at": programme.last_session_at,
        "sessions_per_week": programme.sessions_per_week,
        "therapist": therapists.get(programme.episode_id, ""),
    }


def _patients(session: Session, ids: list[UUID]) -> dict[UUID, SessionPatient]:
    query = select(PatientRow.id, PatientRow.name, PatientRow.clinic_number).where(PatientRow.id.in_(ids))
    return {
        row.id: SessionPatient(id=row.id, name=row.name, clinic_number=row.clinic_number)
        for row in session.connection().execute(query)
    }


_LAST_THERAPISTS: Final = select(
    EpisodeRow.id,
    select(SessionRow.therapist)
    .where(SessionRow.episode_id == EpisodeRow.id, SessionRow.run_count > 0)
    .order_by(SessionRow.started_at.desc())
    .limit(1)
    .correlate(EpisodeRow)
    .scalar_subquery()
    .label("therapist"),
)
"""Query of the therapists of the episodes' last sessions. Building it takes longer than running it."""


def _therapists(session: Session, programmes: list[FollowedProgramme]) -> dict[UUID, str]:
    """Return the therapist of each programme's last session, by episode."""
    seen = [programme.episode_id for programme in programmes if programme.last_session_at]
    if not seen:
        return {}
    query = _LAST_THERAPISTS.where(EpisodeRow.id.in_(seen))
    return {row.id: row.therapist or "" for row in session.connection().execute(query)}


def _of_day(visible: ColumnElement[bool], today: datetime) -> Select[UUID]:
    """Return the query of the newest sessions that began today or are open."""
    # Each part is read in the order of its index and ends with its limit.
    parts = [
        select(SessionRow.id, SessionRow.started_at)
        .where(visible, chosen)
        .order_by(SessionRow.started_at.desc())
        .limit(_MOST)
        .subquery()
        for chosen in (SessionRow.started_at >= today, SessionRow.ended_at.is_(None))
    ]
    candidates = union(*(select(part) for part in parts)).subquery()
    return select(candidates.c.id).order_by(candidates.c.started_at.desc()).limit(_MOST)


def _changes(session: Session, actor: Actor, since: datetime, hidden: Select[UUID]) -> list[PatientChange]:
    """Return the changes between the last two assessments of the actor's patients since a time."""
    held_sessions = _last_sessions(session, actor, since, hidden)
    assessed = select(
        AssessmentRow.episode_id, AssessmentRow.assessed_at, AssessmentRow.spadi_score, AssessmentRow.pain_average
    ).where(
        AssessmentRow.episode_id.in_([held_session.episode_id for held_session in held_sessions]),
        AssessmentRow.withdrawn_at.is_(None),
    )
    values: dict[tuple[UUID, str], list[tuple[datetime, float]]] = defaultdict(list)
    for row in session.connection().execute(assessed.order_by(AssessmentRow.assessed_at)):
        for measure, value in (("spadi", row.spadi_score), ("pain", row.pain_average)):
            if value is not None:
                values[row.episode_id, measure].append((row.assessed_at, float(value)))
    patients = _patients(session, [held_session.patient_id for held_session in held_sessions])
    changes = []
    for held_session in held_sessions:
        for measure in _MEASURES:
            of = values[held_session.episode_id, measure]
            if len(of) > 1 and of[-1][0] >= since:
                changes.append(_change(patients[held_session.patient_id], held_session, measure, of))
    return changes


def _last_sessions(session: Session, actor: Actor, since: datetime, hidden: Select[UUID]) -> list[Any]:
    """Return the last session of each of the actor's last episodes, the newest first."""
    query = (
        select(SessionRow.patient_id, SessionRow.episode_id, EpisodeRow.side, SessionRow.started_at.label("last_at"))
        .join(EpisodeRow, EpisodeRow.id == SessionRow.episode_id)
        .where(
            SessionRow.therapist == actor.name,
            SessionRow.started_at >= since,
            SessionRow.patient_id.not_in(hidden),
        )
        .order_by(SessionRow.started_at.desc())
    )
    last: dict[UUID | None, Any] = {}
    # Few rows name enough episodes, so that the others are not read.
    with session.execute(query, execution_options={"yield_per": _MOST}) as rows:
        for row in rows:
            last.setdefault(row.episode_id, row)
            if len(last) == _CHANGED:
                break
    return list(last.values())


_MEASURES: Final[tuple[Literal["spadi", "pain"], ...]] = ("spadi", "pain")


def _change(
    patient: SessionPatient, held_session: Any, measure: Literal["spadi", "pain"], of: list[tuple[datetime, Any]]
) -> PatientChange:
    (_, before), (at, now) = of[-2:]
    return PatientChange(
        patient=patient,
        last_session_at=held_session.last_at,
        assessed_at=at,
        side=held_session.side,
        measure=measure,
        before=before,
        now=now,
    )
