"""Adherence to an episode's programmes, week by week. The database counts, so that neither samples nor single runs are loaded."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from typing import Final
from uuid import UUID

from pydantic import Field
from sqlalchemy import and_, case, func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.programmes.schemas import Wish
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.base import utc_now
from kata.errors import not_found
from kata.types import Schema

_WEEK: Final = timedelta(days=7)


class AdherenceWeek(Schema):
    """One week, beginning on Monday."""

    begins_on: date = Field(description="The Monday, in the clinic's time zone.", examples=["2026-11-16"])
    sessions: int = Field(ge=0, description="Number of sessions in which a recording was played.", examples=[2])
    sessions_wished: Wish = Field(
        description="Sessions per week as prescribed at the end of the week; null if no number is prescribed."
    )
    repetitions_planned: int = Field(
        ge=0, description="Planned repetitions according to the programmes of these sessions.", examples=[60]
    )
    repetitions_done: int = Field(
        ge=0,
        description="Planned repetitions that were played. Repetitions beyond the plan do not count.",
        examples=[54],
    )


class Adherence(Schema):
    """The weeks from the first session or programme to the present week, or to the week in which the episode was closed."""

    weeks: list[AdherenceWeek] = Field(description="Oldest first, including weeks without a session.")


@dataclass(frozen=True)
class HeldSession:
    """A session in which a recording was played, with its planned and completed repetitions."""

    started_at: datetime
    planned: int = 0
    done: int = 0


@dataclass(frozen=True)
class VersionWish:
    """The number of sessions per week that a version of a programme prescribes from its date on. None: no number is prescribed."""

    programme_id: UUID
    made_at: datetime
    sessions_per_week: int | None
    archived_at: datetime | None


def by_week(
    held_sessions: Iterable[HeldSession], wishes: Iterable[VersionWish], until: datetime, offset: timedelta
) -> list[AdherenceWeek]:
    """Return the weeks. ``offset``: offset of the clinic's time zone from UTC.

    Weeks after ``until`` are included only if a recording was played in them.
    """
    held_sessions, wishes = list(held_sessions), sorted(wishes, key=lambda wish: wish.made_at)
    moments = [held_session.started_at for held_session in held_sessions] + [wish.made_at for wish in wishes]
    if not moments:
        return []
    of_week: dict[date, list[HeldSession]] = defaultdict(list)
    for held_session in held_sessions:
        of_week[_monday(held_session.started_at, offset)].append(held_session)
    monday = _monday(min(moments), offset)
    last = max(_monday(until, offset), *of_week, monday)
    weeks = []
    while monday <= last:
        weeks.append(_week(monday, of_week[monday], _wish(wishes, _moment(monday, offset))))
        monday += _WEEK
    return weeks


def of_episode(session: Session, episode_id: UUID, utc_offset_minutes: int) -> Adherence:
    """Return an episode's weeks.

    :raises ProblemError: 404.
    """
    episode = session.get(EpisodeRow, episode_id)
    if episode is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    until = episode.closed_at or utc_now()
    weeks = by_week(
        _visits(session, episode_id), _version_wishes(session, episode_id), until, timedelta(minutes=utc_offset_minutes)
    )
    return Adherence(weeks=weeks)


def _visits(session: Session, episode_id: UUID) -> list[HeldSession]:
    """Return one entry per session. Extra repetitions of one item do not compensate for another item."""
    of_items = (
        select(RunRow.session_id, RunRow.programme_position, func.sum(RunRow.repetitions_done).label("done"))
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .where(SessionRow.episode_id == episode_id, RunRow.outcome.not_in(("loaded", "unloaded")))
        .group_by(RunRow.session_id, RunRow.programme_position)
        .subquery()
    )
    planned, done = ProgrammeItemRow.repetitions, of_items.c.done
    played = (
        select(
            SessionRow.started_at,
            SessionRow.programme_version_id,
            func.sum(case((planned < done, planned), (planned >= done, done), else_=0)),
        )
        .join(of_items, of_items.c.session_id == SessionRow.id)
        .outerjoin(
            ProgrammeItemRow,
            and_(
                ProgrammeItemRow.version_id == SessionRow.programme_version_id,
                ProgrammeItemRow.position == of_items.c.programme_position,
            ),
        )
        .group_by(SessionRow.id)
    )
    prescribed = (
        select(ProgrammeItemRow.version_id, func.sum(planned).label("repetitions"))
        .join(ProgrammeVersionRow, ProgrammeVersionRow.id == ProgrammeItemRow.version_id)
        .join(ProgrammeRow, ProgrammeRow.id == ProgrammeVersionRow.programme_id)
        .where(ProgrammeRow.episode_id == episode_id)
        .group_by(ProgrammeItemRow.version_id)
    )
    plans: dict[UUID, int] = {row.version_id: row.repetitions for row in session.execute(prescribed)}
    return [
        HeldSession(started_at, plans.get(version_id, 0) if version_id else 0, done)
        for started_at, version_id, done in session.execute(played)
    ]


def _version_wishes(session: Session, episode_id: UUID) -> list[VersionWish]:
    query = (
        select(
            ProgrammeVersionRow.programme_id,
            ProgrammeVersionRow.made_at,
            ProgrammeVersionRow.sessions_per_week,
            ProgrammeRow.archived_at,
        )
        .join(ProgrammeRow, ProgrammeRow.id == ProgrammeVersionRow.programme_id)
        .where(ProgrammeRow.episode_id == episode_id)
    )
    return [VersionWish(*row) for row in session.execute(query)]


def _week(monday: date, held_sessions: list[HeldSession], wish: int | None) -> AdherenceWeek:
    return AdherenceWeek(
        begins_on=monday,
        sessions=len(held_sessions),
        sessions_wished=wish,
        repetitions_planned=sum(held_session.planned for held_session in held_sessions),
        repetitions_done=sum(held_session.done for held_session in held_sessions),
    )


def _wish(wishes: list[VersionWish], begins: datetime) -> int | None:
    """Return the number of sessions per week that is prescribed at the end of a week. If several programmes prescribe one, the newest
    counts.
    """
    newest: dict[UUID, VersionWish] = {}
    for wish in wishes:
        if wish.made_at < begins + _WEEK and not (wish.archived_at and wish.archived_at < begins):
            newest.pop(wish.programme_id, None)
            newest[wish.programme_id] = wish
    wished = [wish.sessions_per_week for wish in newest.values() if wish.sessions_per_week]
    return wished[-1] if wished else None


def _monday(moment: datetime, offset: timedelta) -> date:
    day = (moment + offset).date()
    return day - timedelta(days=day.weekday())


def _moment(day: date, offset: timedelta) -> datetime:
    return datetime(day.year, day.month, day.day, tzinfo=UTC) - offset
