"""Read the data of the charts. Only columns are read, never samples."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Any, Final
from uuid import UUID

from sqlalchemy import ColumnElement, Row, func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.assessments import rom, spadi
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.programmes import adherence
from kata.clinic.programmes.adherence import AdherenceWeek
from kata.clinic.progress.series import (
    PAIN_CONTEXTS,
    PAIN_IN_SESSIONS,
    EndFeelPoint,
    EndRangeGain,
    EndRangePoint,
    LineSeries,
    Point,
    QuestionnairePanel,
    RomLine,
    RomPanel,
    SpadiPoint,
    TotalPoint,
    Tracked,
)
from kata.clinic.questionnaires.definitions import DEFINITIONS, score
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.tables import EndFeelRow, MotionTrackingRow, RunRow, SessionRow
from kata.errors import not_found
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.texts import SIDES
from kata.types import side_of

_WEEK: Final = timedelta(weeks=1)


@dataclass(frozen=True)
class EpisodeTimeline:
    """An episode and the time from which its weeks are counted."""

    episode_id: UUID
    side: str
    begins_at: datetime
    zone: tzinfo = UTC
    """The clinic's time zone. Weeks of the calendar begin on Monday in this zone."""

    def week(self, at: datetime) -> float:
        """Return the number of weeks since the beginning of the timeline."""
        return round((at - self.begins_at) / _WEEK, 3)


def timeline_of(session: Session, episode_id: UUID, zone: tzinfo = UTC) -> EpisodeTimeline:
    """Return the episode's timeline. Its weeks are counted from the first assessment or session.

    :raises ProblemError: 404.
    """
    episode = session.execute(
        select(EpisodeRow.side, EpisodeRow.opened_at).where(EpisodeRow.id == episode_id)
    ).one_or_none()
    if episode is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    firsts = (
        session.scalar(select(func.min(AssessmentRow.assessed_at)).where(*_counted(episode_id))),
        session.scalar(select(func.min(SessionRow.started_at)).where(SessionRow.episode_id == episode_id)),
    )
    begins_at = min((first for first in firsts if first), default=episode.opened_at)
    return EpisodeTimeline(episode_id, episode.side, begins_at, zone)


def rom_panels(session: Session, timeline: EpisodeTimeline) -> list[RomPanel]:
    """Return a panel for each measured motion of the affected shoulder, in the order of the form."""
    query = (
        select(AssessmentRow.assessed_at, RomRow.side, RomRow.motion, RomRow.position, RomRow.kind, RomRow.angle_deg)
        .join(RomRow, RomRow.assessment_id == AssessmentRow.id)
        .where(*_counted(timeline.episode_id))
        .order_by(AssessmentRow.assessed_at, AssessmentRow.id)
    )
    affected: dict[tuple[str, str, str], list[Point]] = defaultdict(list)
    other: dict[tuple[str, str, str], float] = {}
    for at, side, motion, position, kind, angle_deg in session.execute(query):
        if side == timeline.side:
            affected[motion, position, kind].append(Point(at, timeline.week(at), angle_deg))
        else:
            other[motion, position, kind] = angle_deg
    panels = []
    for measure in rom.MEASURES:
        keys = {kind: (measure.motion, measure.position, kind) for kind in rom.KINDS}
        lines = tuple(
            RomLine(kind, tuple(affected[key]), other.get(key)) for kind, key in keys.items() if key in affected
        )
        if lines:
            panels.append(RomPanel(measure, lines))
    return panels


def pain_lines(session: Session, timeline: EpisodeTimeline) -> list[LineSeries]:
    """Return the pain scores of assessments (four contexts) and of sessions (before, during, after). Empty lines are left out."""
    assessed = select(
        AssessmentRow.assessed_at,
        AssessmentRow.pain_rest,
        AssessmentRow.pain_active,
        AssessmentRow.pain_passive,
        AssessmentRow.pain_average,
    )
    assessed = assessed.where(*_counted(timeline.episode_id)).order_by(AssessmentRow.assessed_at)
    treated = select(SessionRow.started_at, SessionRow.pain_before, SessionRow.pain_during, SessionRow.pain_after)
    treated = treated.where(SessionRow.episode_id == timeline.episode_id).order_by(SessionRow.started_at)
    lines = [
        *_lines(timeline, PAIN_CONTEXTS, session.execute(assessed).all()),
        *_lines(timeline, PAIN_IN_SESSIONS, session.execute(treated).all()),
    ]
    return [line for line in lines if line.points]


def spadi_points(session: Session, timeline: EpisodeTimeline) -> list[SpadiPoint]:
    """Return the total scores and both subscales."""
    query = select(AssessmentRow.assessed_at, AssessmentRow.spadi)
    query = query.where(*_counted(timeline.episode_id), AssessmentRow.spadi.is_not(None)).order_by(
        AssessmentRow.assessed_at
    )
    points = []
    for at, answers in session.execute(query):
        assert answers is not None
        scored = spadi.score(answers)
        points.append(SpadiPoint(at, timeline.week(at), scored.total, scored.pain, scored.disability))
    return points


def questionnaire_panels(session: Session, timeline: EpisodeTimeline) -> list[QuestionnairePanel]:
    """Return a panel for each answered questionnaire other than the SPADI. A questionnaire that only another version knows has none."""
    query = select(AssessmentRow.assessed_at, AssessmentRow.questionnaires)
    query = query.where(*_counted(timeline.episode_id)).order_by(AssessmentRow.assessed_at, AssessmentRow.id)
    totals: dict[str, list[TotalPoint]] = defaultdict(list)
    for at, questionnaires in session.execute(query):
        for code, answers in questionnaires.items():
            definition = DEFINITIONS.get(code)
            if definition is not None and definition.fits(answers):
                totals[code].append(TotalPoint(at, timeline.week(at), score(definition, answers).total))
    return [
        QuestionnairePanel(definition, tuple(totals[code]))
        for code, definition in DEFINITIONS.items()
        if code in totals
    ]


def tracked(session: Session, timeline: EpisodeTimeline) -> list[Tracked]:
    """Return the error of each recording by method, session by session."""
    query = (
        select(
            SessionRow.started_at,
            RunRow.recording_id,
            RunRow.method,
            func.count(),
            func.avg(RunRow.worst_rmse_deg),
            func.max(RunRow.worst_peak_deg),
        )
        .join(RunRow, RunRow.session_id == SessionRow.id)
        .where(SessionRow.episode_id == timeline.episode_id, RunRow.worst_rmse_deg.is_not(None))
        .group_by(SessionRow.id, SessionRow.started_at, RunRow.recording_id, RunRow.method)
        .order_by(SessionRow.started_at, RunRow.method)
    )
    names = _names(session, timeline)
    tracked = [
        Tracked(names[recording], method, at, timeline.week(at), playbacks, rmse_deg, peak_deg)
        for at, recording, method, playbacks, rmse_deg, peak_deg in session.execute(query)
    ]
    order = {name: place for place, name in enumerate(names.values())}
    return sorted(tracked, key=lambda playbacks: (playbacks.at, order[playbacks.recording]))


def correction_lines(session: Session, timeline: EpisodeTimeline) -> list[LineSeries]:
    """Return the size of the learned correction at the end of each session, one line per recording."""
    query = (
        select(SessionRow.started_at, RunRow.recording_id, RunRow.learned_rms_deg)
        .join(RunRow, RunRow.session_id == SessionRow.id)
        .where(SessionRow.episode_id == timeline.episode_id, RunRow.learned_rms_deg.is_not(None))
        .order_by(SessionRow.started_at, RunRow.started_at)
    )
    names = _names(session, timeline)
    lines: dict[str, dict[datetime, Point]] = defaultdict(dict)
    for at, recording, rms_deg in session.execute(query):
        assert rms_deg is not None
        lines[names[recording]][at] = Point(at, timeline.week(at), rms_deg)
    return [LineSeries(name, tuple(points.values())) for name, points in lines.items()]


def end_feel_points(session: Session, timeline: EpisodeTimeline) -> list[EndFeelPoint]:
    """Return the figures of the end-feel tests in the episode's sessions."""
    query = (
        select(RunRow.started_at, RecordingRow.side, EndFeelRow)
        .join(RunRow, RunRow.id == EndFeelRow.run_id)
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .join(RecordingRow, RecordingRow.id == RunRow.recording_id)
        .where(
            SessionRow.episode_id == timeline.episode_id, EndFeelRow.kind == "test", EndFeelRow.range_deg.is_not(None)
        )
        .order_by(RunRow.started_at)
    )
    return [
        EndFeelPoint(
            BASIC_MOTIONS[row.motion - 1].name,
            SIDES[side_of(side)],
            at,
            timeline.week(at),
            row.torque_nm,
            row.outward * row.range_deg,
            row.interval_range_deg,
            None if row.onset_deg is None else row.outward * row.onset_deg,
            row.stiffness_nm_deg,
        )
        for at, side, row in session.execute(query)
        if row.range_deg is not None
    ]


def end_range(session: Session, timeline: EpisodeTimeline) -> EndRangeGain:
    """Return the end-range time of each motion and session, with the gain of passive range. Recordings of the other shoulder do not
    count.
    """
    query = (
        select(SessionRow.started_at, MotionTrackingRow.motion, func.sum(MotionTrackingRow.end_range_s))
        .join(RunRow, RunRow.session_id == SessionRow.id)
        .join(RecordingRow, RecordingRow.id == RunRow.recording_id)
        .join(MotionTrackingRow, MotionTrackingRow.run_id == RunRow.id)
        .where(
            SessionRow.episode_id == timeline.episode_id,
            RecordingRow.side == timeline.side,
            MotionTrackingRow.end_range_s.is_not(None),
        )
        .group_by(SessionRow.id, SessionRow.started_at, MotionTrackingRow.motion)
        .order_by(SessionRow.started_at, MotionTrackingRow.motion)
    )
    sums: dict[tuple[int, int], float] = defaultdict(float)
    points = []
    for at, motion, seconds in session.execute(query):
        week, minutes = timeline.week(at), (seconds or 0.0) / 60
        sums[motion, int(week)] += minutes
        points.append(EndRangePoint(BASIC_MOTIONS[motion - 1].name, at, week, minutes, sums[motion, int(week)]))
    gains = (
        LineSeries(
            panel.measure.english,
            tuple(Point(point.at, point.week, point.value - line.points[0].value) for point in line.points),
        )
        for panel in rom_panels(session, timeline)
        for line in panel.lines
        if line.kind == "passive"
    )
    return EndRangeGain(tuple(points), tuple(gains))


def weeks(session: Session, timeline: EpisodeTimeline) -> list[AdherenceWeek]:
    """Return every week from the first session or programme on, including weeks without a session."""
    return adherence.of_episode(session, timeline.episode_id, timeline.zone).weeks


def any_simulated(session: Session, episode_id: UUID) -> bool:
    """Return True if a session of the episode was on a simulated apparatus."""
    simulated = select(SessionRow.id).where(SessionRow.episode_id == episode_id, SessionRow.simulated)
    return session.scalar(simulated.limit(1)) is not None


def _counted(episode_id: UUID) -> tuple[ColumnElement[bool], ...]:
    """Return conditions that select the episode's assessments, except withdrawn ones."""
    return AssessmentRow.episode_id == episode_id, AssessmentRow.withdrawn_at.is_(None)


def _lines(timeline: EpisodeTimeline, names: Sequence[str], rows: Sequence[Row[*tuple[Any, ...]]]) -> list[LineSeries]:
    """Return one line for each column after the first, which contains the time. A missing value makes no point."""
    return [
        LineSeries(
            name, tuple(Point(row[0], timeline.week(row[0]), row[column]) for row in rows if row[column] is not None)
        )
        for column, name in enumerate(names, start=1)
    ]


def _names(session: Session, timeline: EpisodeTimeline) -> dict[UUID, str]:
    """Return the names of the patient's recordings. Recordings with the same name get numbers, in the order of creation."""
    patient = select(EpisodeRow.patient_id).where(EpisodeRow.id == timeline.episode_id).scalar_subquery()
    query = select(RecordingRow.id, RecordingRow.name).where(RecordingRow.patient_id == patient)
    used: Counter[str] = Counter()
    names = {}
    for key, name in session.execute(query.order_by(RecordingRow.taught_at, RecordingRow.id)):
        used[name] += 1
        names[key] = name if used[name] == 1 else f"{name} ({used[name]})"
    return names
