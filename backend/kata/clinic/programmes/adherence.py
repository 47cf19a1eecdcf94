"""Adherence to an episode's programmes, week by week. The database counts, so that neither samples nor single runs are loaded."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime, timedelta, tzinfo
from typing import Final
from uuid import UUID

from pydantic import Field
from sqlalchemy import and_, case, func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.local_time import midnight
from kata.clinic.programmes.schemas import SessionsPerWeek
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.clinic.sessions.tables import MotionTrackingRow, RunRow, SessionRow
from kata.database.base import utc_now
from kata.errors import not_found
from kata.motion.axes import BASIC_MOTIONS
from kata.station.schemas import OptionalKey, TextKey
from kata.types import Moment, Schema

_WEEK: Final = timedelta(days=7)


class EndRangeDone(Schema):
    """The end-range time of one motion: counted in the items that prescribe it, and prescribed."""

    motion: int = Field(ge=3, le=6, description="Number of the motion in Table 2.", examples=[4])
    name: str = Field(examples=["Abduction / adduction of the shoulder"])
    name_key: OptionalKey = None
    counted_s: float | None = Field(
        ge=0, description="Seconds; null if none was counted, for example because the station's load is not identified."
    )
    prescribed_s: float | None = Field(
        gt=0,
        description="Seconds; of a week: time per session times sessions per week, null if their number is not prescribed.",
    )


class EndRangeSession(Schema):
    """The prescribed motions of a session's programme."""

    session_id: UUID
    started_at: Moment
    motions: list[EndRangeDone]


class AdherenceWeek(Schema):
    """One week, beginning on Monday."""

    begins_on: date = Field(description="The Monday, in the clinic's time zone.", examples=["2026-11-16"])
    sessions: int = Field(ge=0, description="Number of sessions in which a recording was played.", examples=[2])
    sessions_prescribed: SessionsPerWeek = Field(
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
    end_range: list[EndRangeDone] = Field(
        [], description="The week's motions with a counted or prescribed end-range time."
    )
    end_range_sessions: list[EndRangeSession] = Field(
        [], description="The week's sessions whose programme prescribes an end-range time, oldest first."
    )


class Adherence(Schema):
    """The weeks from the first session or programme to the present week, or to the week in which the episode was closed."""

    weeks: list[AdherenceWeek] = Field(description="Oldest first, including weeks without a session.")


@dataclass(frozen=True)
class EndRangeTime:
    """The end-range time of one motion in a session or in a week."""

    period: EndRangeSession | AdherenceWeek
    done: EndRangeDone
    is_simulated: bool
    """True if it contains a session on a simulated apparatus."""
    is_complete: bool
    """True if the session has ended, or the week in the clinic's zone with all its sessions."""


@dataclass(frozen=True)
class HeldSession:
    """A session in which a recording was played, with its planned and completed repetitions."""

    started_at: datetime
    planned: int = 0
    done: int = 0
    end_range: EndRangeSession | None = None
    """None if the session's programme prescribes no end-range time."""


@dataclass(frozen=True)
class VersionTarget:
    """The number of sessions per week and the end-range times per session that a version of a programme prescribes from its date on."""

    programme_id: UUID
    made_at: datetime
    sessions_per_week: int | None
    """None: no number is prescribed."""
    archived_at: datetime | None
    end_range_s: Mapping[int, float] = field(default_factory=dict)
    """Seconds per session, by motion."""


def by_week(
    held_sessions: Iterable[HeldSession], targets: Iterable[VersionTarget], until: datetime, zone: tzinfo
) -> list[AdherenceWeek]:
    """Return the weeks. ``zone``: the clinic's time zone.

    Weeks after ``until`` are included only if a recording was played in them.
    """
    held_sessions, targets = list(held_sessions), sorted(targets, key=lambda target: target.made_at)
    moments = [held_session.started_at for held_session in held_sessions] + [target.made_at for target in targets]
    if not moments:
        return []
    of_week: dict[date, list[HeldSession]] = defaultdict(list)
    for held_session in held_sessions:
        of_week[_monday(held_session.started_at, zone)].append(held_session)
    monday = _monday(min(moments), zone)
    last = max(_monday(until, zone), *of_week, monday)
    weeks = []
    while monday <= last:
        weeks.append(
            _week(
                monday,
                of_week[monday],
                _target_of_week(targets, midnight(monday, zone), midnight(monday + _WEEK, zone)),
            )
        )
        monday += _WEEK
    return weeks


def of_episode(session: Session, episode_id: UUID, zone: tzinfo) -> Adherence:
    """Return an episode's weeks. ``zone``: the clinic's time zone.

    :raises ProblemError: 404.
    """
    episode = session.get(EpisodeRow, episode_id)
    if episode is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    until = episode.closed_at or utc_now()
    weeks = by_week(_visits(session, episode_id), _version_targets(session, episode_id), until, zone)
    return Adherence(weeks=weeks)


def end_range_times(session: Session, episode_id: UUID, zone: tzinfo) -> Iterator[EndRangeTime]:
    """Yield each end-range time of an episode's sessions and weeks. ``zone``: the clinic's time zone."""
    now = utc_now()
    for week in of_episode(session, episode_id, zone).weeks:
        rows = []
        for of_session in week.end_range_sessions:
            row = session.get_one(SessionRow, of_session.session_id)
            rows.append(row)
            for done in of_session.motions:
                yield EndRangeTime(of_session, done, bool(row.simulated), row.ended_at is not None)
        any_simulated = any(row.simulated for row in rows)
        is_complete = now >= midnight(week.begins_on + _WEEK, zone) and all(row.ended_at for row in rows)
        for done in week.end_range:
            yield EndRangeTime(week, done, any_simulated, is_complete)


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
            SessionRow.id,
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
    prescribed_s = _prescribed_s(session, episode_id)
    counted_s = _counted_s(session, episode_id)
    return [
        HeldSession(
            started_at,
            plans.get(version_id, 0) if version_id else 0,
            done,
            _end_range_of(session_id, started_at, prescribed_s.get(version_id, {}), counted_s),
        )
        for session_id, started_at, version_id, done in session.execute(played)
    ]


def _prescribed_s(session: Session, episode_id: UUID) -> dict[UUID | None, dict[int, float]]:
    """Return the prescribed seconds per session by version and motion."""
    query = (
        select(ProgrammeItemRow.version_id, ProgrammeItemRow.end_range)
        .join(ProgrammeVersionRow, ProgrammeVersionRow.id == ProgrammeItemRow.version_id)
        .join(ProgrammeRow, ProgrammeRow.id == ProgrammeVersionRow.programme_id)
        .where(ProgrammeRow.episode_id == episode_id, ProgrammeItemRow.end_range.is_not(None))
    )
    prescribed_s: dict[UUID | None, dict[int, float]] = defaultdict(lambda: defaultdict(float))
    for version_id, stored in session.execute(query):
        prescribed = EndRangePrescription.model_validate(stored)
        prescribed_s[version_id][prescribed.motion] += 60.0 * prescribed.minutes
    return prescribed_s


def _counted_s(session: Session, episode_id: UUID) -> dict[tuple[UUID, int], float]:
    """Return the counted seconds by session and motion, of the items that prescribe the motion."""
    query = (
        select(RunRow.session_id, MotionTrackingRow.motion, MotionTrackingRow.end_range_s, ProgrammeItemRow.end_range)
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .join(MotionTrackingRow, MotionTrackingRow.run_id == RunRow.id)
        .join(
            ProgrammeItemRow,
            and_(
                ProgrammeItemRow.version_id == SessionRow.programme_version_id,
                ProgrammeItemRow.position == RunRow.programme_position,
            ),
        )
        .where(
            SessionRow.episode_id == episode_id,
            MotionTrackingRow.end_range_s.is_not(None),
            ProgrammeItemRow.end_range.is_not(None),
        )
    )
    counted_s: dict[tuple[UUID, int], float] = defaultdict(float)
    for session_id, motion, seconds, prescribed in session.execute(query):
        if prescribed["motion"] == motion:
            counted_s[session_id, motion] += seconds
    return counted_s


def _end_range_of(
    session_id: UUID,
    started_at: datetime,
    prescribed_s: Mapping[int, float],
    counted_s: Mapping[tuple[UUID, int], float],
) -> EndRangeSession | None:
    if not prescribed_s:
        return None
    motions = [
        _end_range_done(motion, counted_s.get((session_id, motion)), seconds)
        for motion, seconds in sorted(prescribed_s.items())
    ]
    return EndRangeSession(session_id=session_id, started_at=started_at, motions=motions)


def _end_range_done(motion: int, counted_s: float | None, prescribed_s: float | None) -> EndRangeDone:
    name = BASIC_MOTIONS[motion - 1].name
    return EndRangeDone(
        motion=motion, name=name, name_key=TextKey.of(name), counted_s=counted_s, prescribed_s=prescribed_s
    )


def _version_targets(session: Session, episode_id: UUID) -> list[VersionTarget]:
    query = (
        select(
            ProgrammeVersionRow.id,
            ProgrammeVersionRow.programme_id,
            ProgrammeVersionRow.made_at,
            ProgrammeVersionRow.sessions_per_week,
            ProgrammeRow.archived_at,
        )
        .join(ProgrammeRow, ProgrammeRow.id == ProgrammeVersionRow.programme_id)
        .where(ProgrammeRow.episode_id == episode_id)
    )
    prescribed_s = _prescribed_s(session, episode_id)
    return [
        VersionTarget(programme_id, made_at, per_week, archived_at, prescribed_s.get(version_id, {}))
        for version_id, programme_id, made_at, per_week, archived_at in session.execute(query)
    ]


def _week(monday: date, held_sessions: list[HeldSession], target: VersionTarget | None) -> AdherenceWeek:
    of_sessions = [held_session.end_range for held_session in held_sessions if held_session.end_range]
    end_range_sessions = sorted(of_sessions, key=lambda of_session: of_session.started_at)
    return AdherenceWeek(
        begins_on=monday,
        sessions=len(held_sessions),
        sessions_prescribed=target.sessions_per_week if target else None,
        repetitions_planned=sum(held_session.planned for held_session in held_sessions),
        repetitions_done=sum(held_session.done for held_session in held_sessions),
        end_range=_end_range_of_week(end_range_sessions, target),
        end_range_sessions=end_range_sessions,
    )


def _end_range_of_week(of_sessions: Iterable[EndRangeSession], target: VersionTarget | None) -> list[EndRangeDone]:
    counted_s: dict[int, float | None] = {}
    for done in (done for of_session in of_sessions for done in of_session.motions):
        before = counted_s.get(done.motion)
        counted_s[done.motion] = before if done.counted_s is None else (before or 0.0) + done.counted_s
    prescribed_s: dict[int, float] = {}
    if target and target.sessions_per_week:
        prescribed_s = {motion: seconds * target.sessions_per_week for motion, seconds in target.end_range_s.items()}
    return [
        _end_range_done(motion, counted_s.get(motion), prescribed_s.get(motion))
        for motion in sorted({*counted_s, *prescribed_s})
    ]


def _target_of_week(targets: list[VersionTarget], begins: datetime, ends: datetime) -> VersionTarget | None:
    """Return the version whose sessions per week are prescribed at the end of a week. If several programmes prescribe a number, the newest
    counts.
    """
    newest: dict[UUID, VersionTarget] = {}
    for target in targets:
        if target.made_at < ends and not (target.archived_at and target.archived_at < begins):
            newest.pop(target.programme_id, None)
            newest[target.programme_id] = target
    with_target = [target for target in newest.values() if target.sessions_per_week]
    return with_target[-1] if with_target else None


def _monday(moment: datetime, zone: tzinfo) -> date:
    day = moment.astimezone(zone).date()
    return day - timedelta(days=day.weekday())
