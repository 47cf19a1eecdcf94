"""The work of the day: sessions, patients who are due, unsigned notes, and changes of the therapist's patients."""

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime, timedelta, tzinfo
from typing import Any, Final, Literal
from uuid import UUID

from sqlalchemy import Select, case, func, select, union
from sqlalchemy.orm import Session, aliased

from kata.actor import Actor
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.local_time import midnight
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import lists
from kata.clinic.sessions.lists import SessionSummary
from kata.clinic.sessions.schemas import SessionPatient
from kata.clinic.sessions.tables import SessionRow
from kata.clinic.statistics.schemas import DuePatient, PatientChange, ProgrammeAdherence, Worklist

RECENT: Final = timedelta(weeks=4)
"""A patient without a session or a new programme in this time is no longer expected, and the clinic must call. The value is our choice."""
_MOST: Final = 50
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

    @property
    def due_at(self) -> datetime:
        """Return the time at which the next session is due. For a new programme this is at once."""
        if self.last_session_at is None:
            return self.made_at
        return self.last_session_at + _WEEK / self.sessions_per_week

    def prescribed(self, now: datetime) -> int:
        """Return the number of sessions prescribed in the last four weeks, or since the programme was made."""
        return int(min(RECENT, now - self.made_at) / _WEEK * self.sessions_per_week)


def worklist(session: Session, actor: Actor, now: datetime, zone: tzinfo | None) -> Worklist:
    """Return the work of the local day for one user. ``zone``: the clinic's time zone; None: this computer's."""
    hidden = restricted.hidden(actor)
    day = now.astimezone(zone).date()
    today, tomorrow = midnight(day, zone), midnight(day + timedelta(days=1), zone)
    due, count = _due(session, followed(session, now, hidden), tomorrow)
    visible = SessionRow.patient_id.not_in(hidden)
    of_day = union(
        select(SessionRow.id).where(SessionRow.started_at >= today),
        select(SessionRow.id).where(SessionRow.ended_at.is_(None)),
    )
    mine = (SessionRow.signed_at.is_(None), SessionRow.ended_at.is_not(None), SessionRow.therapist == actor.name)
    return Worklist(
        sessions=_summaries(
            session, select(SessionRow.id).where(visible, SessionRow.id.in_(of_day)), newest_first=True
        ),
        due=due,
        due_count=count,
        unsigned=_summaries(session, select(SessionRow.id).where(visible, *mine), newest_first=False),
        changes=_changes(session, actor, now, hidden),
    )


def followed(session: Session, now: datetime, hidden: Select[UUID] | None = None) -> list[FollowedProgramme]:
    """Return the newest version of each followed programme with a prescribed number of sessions. Of several in an episode, return the
    newest. Archived patients are no longer expected.

    ``hidden``: query of the ids of patients to leave out.
    """
    since = now - RECENT
    # Materialized, because SQLite would otherwise read every session of the clinic in the order of the episodes.
    recent = (
        select(SessionRow.episode_id, SessionRow.started_at)
        .where(SessionRow.started_at >= since, SessionRow.run_count > 0)
        .cte("recent")
        .prefix_with("MATERIALIZED")
    )
    held_sessions = (
        select(recent.c.episode_id, func.max(recent.c.started_at).label("last_at"), func.count().label("held"))
        .group_by(recent.c.episode_id)
        .cte("held_sessions")
    )
    new = select(ProgrammeRow.episode_id).join(ProgrammeVersionRow).where(ProgrammeVersionRow.made_at >= since)
    among = union(select(held_sessions.c.episode_id), new).subquery("among")
    other = aliased(ProgrammeVersionRow)
    newest = select(func.max(other.number)).where(other.programme_id == ProgrammeRow.id).scalar_subquery()
    # Sessions are prescribed from the version's date on, so that earlier ones do not make up for them.
    held_since_made = (
        select(func.count())
        .where(
            SessionRow.episode_id == EpisodeRow.id,
            SessionRow.run_count > 0,
            SessionRow.started_at >= ProgrammeVersionRow.made_at,
        )
        .correlate(EpisodeRow, ProgrammeVersionRow)
        .scalar_subquery()
    )
    held = case((ProgrammeVersionRow.made_at > since, held_since_made), else_=func.coalesce(held_sessions.c.held, 0))
    query = (
        select(
            ProgrammeRow.episode_id, EpisodeRow.patient_id, ProgrammeVersionRow.sessions_per_week, ProgrammeVersionRow.made_at,
            held_sessions.c.last_at, held,
        )
        .select_from(among)
        .join(EpisodeRow, EpisodeRow.id == among.c.episode_id)
        .join(PatientRow, PatientRow.id == EpisodeRow.patient_id)
        .join(ProgrammeRow, ProgrammeRow.episode_id == EpisodeRow.id)
        .join(ProgrammeVersionRow, ProgrammeVersionRow.programme_id == ProgrammeRow.id)
        .outerjoin(held_sessions, held_sessions.c.episode_id == EpisodeRow.id)
        .where(
            EpisodeRow.closed_at.is_(None),
            PatientRow.archived_at.is_(None),
            ProgrammeRow.archived_at.is_(None),
            ProgrammeVersionRow.number == newest,
            ProgrammeVersionRow.sessions_per_week > 0,
        )
        .order_by(ProgrammeVersionRow.made_at)
    )  # fmt: skip
    if hidden is not None:
        query = query.where(EpisodeRow.patient_id.not_in(hidden))
    return list({row.episode_id: FollowedProgramme(*row) for row in session.execute(query)}.values())


def adherence(programmes: list[FollowedProgramme], now: datetime) -> ProgrammeAdherence:
    """Return how these programmes were followed in the last four weeks."""
    prescribed = [programme.prescribed(now) for programme in programmes]
    return ProgrammeAdherence(
        programmes=len(programmes),
        overdue=sum(programme.due_at < now - timedelta(days=1) for programme in programmes),
        prescribed=sum(prescribed),
        held=sum(min(programme.held, most) for programme, most in zip(programmes, prescribed, strict=True)),
    )


def _due(session: Session, programmes: list[FollowedProgramme], before: datetime) -> tuple[list[DuePatient], int]:
    due = sorted(
        (programme for programme in programmes if programme.due_at < before),
        key=lambda due_programme: due_programme.due_at,
    )
    shown = due[:_MOST]
    patients = _patients(session, [programme.patient_id for programme in shown])
    therapists = _therapists(session, shown)
    return [
        DuePatient(
            patient=patients[programme.patient_id],
            due_at=programme.due_at,
            last_session_at=programme.last_session_at,
            sessions_per_week=programme.sessions_per_week,
            therapist=therapists.get(programme.episode_id, ""),
        )
        for programme in shown
        if programme.patient_id in patients
    ], len(due)


def _patients(session: Session, ids: list[UUID]) -> dict[UUID, SessionPatient]:
    query = select(PatientRow.id, PatientRow.name, PatientRow.clinic_number).where(PatientRow.id.in_(ids))
    return {
        row.id: SessionPatient(id=row.id, name=row.name, clinic_number=row.clinic_number)
        for row in session.execute(query)
    }


def _therapists(session: Session, programmes: list[FollowedProgramme]) -> dict[UUID, str]:
    """Return the therapist of each programme's last session."""
    last_at = {programme.patient_id: programme for programme in programmes if programme.last_session_at}
    if not last_at:
        return {}
    oldest = min(programme.last_session_at for programme in last_at.values() if programme.last_session_at)
    query = select(SessionRow.patient_id, SessionRow.started_at, SessionRow.therapist).where(
        SessionRow.patient_id.in_(last_at), SessionRow.started_at >= oldest
    )
    return {
        last_at[row.patient_id].episode_id: row.therapist
        for row in session.execute(query)
        if row.started_at == last_at[row.patient_id].last_session_at
    }


def _summaries(session: Session, wanted: Select[UUID], *, newest_first: bool) -> list[SessionSummary]:
    order = SessionRow.started_at.desc() if newest_first else SessionRow.started_at.asc()
    return lists.summaries(session, wanted.order_by(order).limit(_MOST), order)


def _changes(session: Session, actor: Actor, now: datetime, hidden: Select[UUID]) -> list[PatientChange]:
    """Return the changes between the last two assessments of the actor's last patients."""
    last = func.max(SessionRow.started_at).label("last_at")
    held_sessions = session.execute(
        select(SessionRow.patient_id, SessionRow.episode_id, EpisodeRow.side, last)
        .join(EpisodeRow, EpisodeRow.id == SessionRow.episode_id)
        .where(
            SessionRow.therapist == actor.name,
            SessionRow.started_at >= now - RECENT,
            SessionRow.patient_id.not_in(hidden),
        )
        .group_by(SessionRow.patient_id, SessionRow.episode_id, EpisodeRow.side)
        .order_by(last.desc())
        .limit(_CHANGED)
    ).all()
    assessed = select(
        AssessmentRow.episode_id, AssessmentRow.assessed_at, AssessmentRow.spadi_score, AssessmentRow.pain_average
    ).where(
        AssessmentRow.episode_id.in_([held_session.episode_id for held_session in held_sessions]),
        AssessmentRow.withdrawn_at.is_(None),
    )
    values: dict[tuple[UUID, str], list[tuple[datetime, float]]] = defaultdict(list)
    for row in session.execute(assessed.order_by(AssessmentRow.assessed_at)):
        for measure, value in (("spadi", row.spadi_score), ("pain", row.pain_average)):
            if value is not None:
                values[row.episode_id, measure].append((row.assessed_at, float(value)))
    patients = _patients(session, [held_session.patient_id for held_session in held_sessions])
    changes = []
    for held_session in held_sessions:
        for measure in _MEASURES:
            of = values[held_session.episode_id, measure]
            if len(of) > 1 and of[-1][0] >= now - RECENT:
                changes.append(_change(patients[held_session.patient_id], held_session, measure, of))
    return changes


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
