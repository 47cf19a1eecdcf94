"""Compare plan and result of a session: the runs of each item, the skipped items and the extra runs."""

from collections.abc import Sequence
from typing import Final, Literal
from uuid import UUID

from pydantic import Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session, lazyload

from kata.clinic import texts
from kata.clinic.programmes import service
from kata.clinic.programmes.schemas import Duration, Number, ProgrammeItem
from kata.clinic.programmes.tables import ProgrammeVersionRow
from kata.clinic.sessions.schemas import PlaybackSettings, RunOutcome
from kata.clinic.sessions.tables import MotionTrackingRow, RunRow, SessionRow
from kata.errors import ProblemError, not_found
from kata.motion.method import Method
from kata.station.schemas import ResistanceLevel
from kata.types import Moment, Schema

Setting = Literal[
    "speed_percent", "repetitions", "pause_s", "range_percent", "resistance_level", "method", "self_paced"
]
Share = Literal["all", "some", "none"]
_SETTINGS: Final[tuple[Setting, ...]] = (
    "speed_percent", "repetitions", "pause_s", "range_percent", "resistance_level", "method", "self_paced",
)  # fmt: skip
_Count = Field(ge=0, description="Repetitions.", examples=[10])


class PlannedRun(PlaybackSettings):
    """One playback, compared with the plan."""

    run_id: UUID
    recording_id: UUID
    recording_name: str
    started_at: Moment
    outcome: RunOutcome
    resistance_level: ResistanceLevel | None
    method: Method | None
    self_paced: bool = Field(description="True if the patient's effort set the pace.")
    least_range_percent: float | None = Field(
        description="Smallest share of the range that was played after the range was reduced; null if it was not reduced."
    )
    repetitions_done: int | None = Field(
        ge=0,
        description="Completed repetitions; null while the run continues, and for runs of versions that did not count them.",
    )
    changed: list[Setting] = Field(description="The settings that differ from the plan.")


class ItemDone(ProgrammeItem):
    """One item of the programme and its result."""

    runs: list[PlannedRun] = Field(description="Runs of this item, in the order of playback.")
    repetitions_done: int = _Count
    end_range_s: float | None = Field(
        None,
        ge=0,
        description="Counted end-range time of the prescribed motion in these runs, seconds; null if none was counted or prescribed.",
    )
    done: Share = Field(
        description="none: the item was skipped or is not due yet. some: fewer repetitions than planned."
    )


class PlanTimer(Schema):
    """The remaining time of the programme."""

    minutes: float = Field(ge=0, description="Minutes of playing after which no further item is started.")
    played_s: Duration
    left_s: float = Field(ge=0, description="Remaining seconds; 0: no further item may be started.")


class Plan(Schema):
    """The result of a programme."""

    items: list[ItemDone]
    besides: list[PlannedRun] = Field(description="Runs that were not planned.")
    repetitions_planned: int = _Count
    repetitions_done: int = Field(
        ge=0, description="Planned repetitions that were played. Repetitions beyond the plan do not count."
    )


class PlannedProgramme(Schema):
    """The programme, in the version with which the session began."""

    id: UUID
    name: str
    version_id: UUID
    number: Number
    duration_s: Duration


class SessionPlan(Plan):
    """A session's programme and its result."""

    session_id: UUID
    ended: bool
    programme: PlannedProgramme | None = Field(description="Null if recordings were chosen one by one.")
    played_s: Duration
    timer: PlanTimer | None


def left_s(timer_minutes: float, played_s: float) -> float:
    """Return the remaining playing time in seconds. At 0 no further item is started; an item that has started is played to its end."""
    return max(0.0, 60.0 * timer_minutes - played_s)


def check_timer(session: Session, session_id: UUID) -> None:
    """Check the timer before an item is started.

    :raises ProblemError: 404; 409 when the programme's time is over.
    """
    timer = of_session(session, session_id).timer
    if timer and not timer.left_s:
        raise timer_over(timer.minutes)


def timer_over(minutes: float) -> ProblemError:
    """Return the error for a programme whose playing time is over."""
    return ProblemError(
        409,
        "timer_over",
        texts.TIMER_OVER(minutes=minutes),
        texts.GO_ON_TO_PAIN_AFTER(),
    )


def compare(items: Sequence[ProgrammeItem], runs: Sequence[RunRow]) -> Plan:
    """Compare plan and runs item by item. A run of another recording does not belong to the item."""
    recordings = {item.position: item.recording_id for item in items}
    of_items: dict[int, list[RunRow]] = {item.position: [] for item in items}
    besides = []
    for run in runs:
        position = run.programme_position
        if position is not None and recordings.get(position) == run.recording_id:
            of_items[position].append(run)
        else:
            besides.append(_as_run(run, None))
    done_items = [_item(item, of_items[item.position]) for item in items]
    return Plan(
        items=done_items,
        besides=besides,
        repetitions_planned=sum(item.repetitions for item in items),
        repetitions_done=sum(min(item.repetitions, item.repetitions_done) for item in done_items),
    )


def of_session(session: Session, session_id: UUID) -> SessionPlan:
    """Return plan and result of a session.

    :raises ProblemError: 404.
    """
    clinic_session = session.execute(
        select(SessionRow.ended_at, SessionRow.programme_version_id).where(SessionRow.id == session_id)
    ).one_or_none()
    if clinic_session is None:
        raise not_found(texts.SESSION_NOT_FOUND)
    version = (
        session.get(ProgrammeVersionRow, clinic_session.programme_version_id)
        if clinic_session.programme_version_id
        else None
    )
    runs = _runs(session, session_id)
    played_s = sum(run.played_s or 0.0 for run in runs)
    programme, timer, items = None, None, []
    if version:
        programme_version = service.as_version(version)
        items = programme_version.items
        programme = PlannedProgramme(
            id=version.programme_id,
            name=version.programme.name,
            version_id=version.id,
            number=version.number,
            duration_s=programme_version.duration_s,
        )
        if version.timer_minutes:
            timer = PlanTimer(
                minutes=version.timer_minutes, played_s=played_s, left_s=left_s(version.timer_minutes, played_s)
            )
    plan = compare(items, runs)
    _add_end_range(session, session_id, plan.items)
    return SessionPlan(
        session_id=session_id,
        ended=clinic_session.ended_at is not None,
        programme=programme,
        played_s=played_s,
        timer=timer,
        **dict(plan),
    )


def _add_end_range(session: Session, session_id: UUID, items: Sequence[ItemDone]) -> None:
    """Set the counted time of each item with a prescribed end-range time."""
    if not any(item.end_range for item in items):
        return
    query = (
        select(RunRow.programme_position, MotionTrackingRow.motion, func.sum(MotionTrackingRow.end_range_s))
        .join(MotionTrackingRow, MotionTrackingRow.run_id == RunRow.id)
        .where(RunRow.session_id == session_id)
        .group_by(RunRow.programme_position, MotionTrackingRow.motion)
    )
    counted_s = {(position, motion): seconds for position, motion, seconds in session.execute(query)}
    for item in items:
        if item.end_range:
            item.end_range_s = counted_s.get((item.position, item.end_range.motion))


def _runs(session: Session, session_id: UUID) -> list[RunRow]:
    """Return the runs without their tracking data."""
    query = (
        select(RunRow)
        .where(RunRow.session_id == session_id)
        .options(lazyload(RunRow.tracking), lazyload(RunRow.motions))
        .order_by(RunRow.started_at, RunRow.id)
    )
    return list(session.scalars(query))


def _item(item: ProgrammeItem, runs: Sequence[RunRow]) -> ItemDone:
    done = sum(run.repetitions_done or 0 for run in runs)
    share: Share = "all" if done >= item.repetitions else "some" if done or any(map(_has_begun, runs)) else "none"
    return ItemDone(**dict(item), runs=[_as_run(run, item) for run in runs], repetitions_done=done, done=share)


def _has_begun(run: RunRow) -> bool:
    return run.outcome != "unloaded" and run.played_s != 0.0


def _as_run(run: RunRow, item: ProgrammeItem | None) -> PlannedRun:
    return PlannedRun(
        run_id=run.id,
        recording_id=run.recording_id,
        recording_name=run.recording.name,
        started_at=run.started_at,
        outcome=run.outcome,
        speed_percent=run.speed_percent,
        repetitions=run.repetitions,
        pause_s=run.pause_s,
        range_percent=run.range_percent,
        resistance_level=run.resistance_level,
        method=run.method,
        self_paced=run.self_paced,
        least_range_percent=run.least_range_percent,
        repetitions_done=run.repetitions_done,
        changed=[name for name in _SETTINGS if item and _differs(name, run, item)],
    )


def _differs(name: Setting, run: RunRow, item: ProgrammeItem) -> bool:
    if name == "pause_s" and run.repetitions == item.repetitions == 1:
        # A single repetition has no pause, so its setting does not differ.
        return False
    return bool(getattr(run, name) != getattr(item, name))
