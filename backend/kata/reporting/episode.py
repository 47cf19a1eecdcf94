"""Read the content of an episode's report."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from datetime import tzinfo
from typing import Final, NamedTuple
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.assessments import rom
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.kinds import kind_of
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.programmes import adherence
from kata.clinic.programmes.tables import ProgrammeItemRow
from kata.clinic.questionnaires.changes import meaning_of
from kata.clinic.questionnaires.definitions import DEFINITIONS, SPADI, Definition, Threshold, score
from kata.clinic.rounding import change_as_shown
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.errors import not_found
from kata.reporting.content import (
    DatedValue,
    EpisodeContent,
    Limit,
    PrintedContraindication,
    PrintedSession,
    PrintedStage,
    PrintedStop,
    PrintedThreshold,
    QuestionnaireSeries,
    RomSeries,
    ScoreSeries,
    motor_of,
)
from kata.reporting.session import end_range_of, report_patient

PAINS: Final = ("rest", "active", "passive", "average")


class _Played(NamedTuple):
    position: int | None
    recording_id: UUID
    repetitions: int
    rmse_deg: float | None
    outcome: str


def read_content(session: DatabaseSession, episode_id: UUID, zone: tzinfo) -> EpisodeContent:
    """Return the content of the report.

    :param zone: the clinic's time zone. It determines the weeks.
    :raises ProblemError: 404.
    """
    row = session.get(EpisodeRow, episode_id)
    if row is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    assessments = session.scalars(
        select(AssessmentRow)
        .where(AssessmentRow.episode_id == episode_id, AssessmentRow.withdrawn_at.is_(None))
        .order_by(AssessmentRow.assessed_at, AssessmentRow.id)
    ).all()
    return EpisodeContent(
        patient=report_patient(patients.get(session, row.patient_id)),
        side=row.side,
        diagnosis=row.diagnosis,
        diagnosis_code=row.diagnosis_code,
        verification=row.verification,
        onset_on=row.onset_on,
        opened_at=row.opened_at,
        closed_at=row.closed_at,
        contraindications=row.contraindications,
        listed=_listed(session, row),
        limits=tuple(Limit(**limit) for limit in row.limits),
        max_resistance_level=row.max_resistance_level,
        max_speed_deg_s=row.max_speed_deg_s,
        limits_by=row.limits_by,
        stages=tuple(PrintedStage(stage.stage, stage.since) for stage in row.stages),
        assessed_at=tuple(assessment.assessed_at for assessment in assessments),
        rom=_rom(assessments, row.side),
        pain=_pain(assessments),
        questionnaires=tuple(_questionnaires(assessments)),
        sessions=_sessions(session, episode_id),
        stops=_stops(session, episode_id),
        closing_note=row.closing_note,
        end_range_weeks=tuple(
            of_week for week in adherence.of_episode(session, episode_id, zone).weeks for of_week in end_range_of(week)
        ),
    )


def _listed(session: DatabaseSession, episode: EpisodeRow) -> tuple[PrintedContraindication, ...]:
    """Return the contraindications of the patient and of this episode, and those of the shoulder's other episodes that applied during it.

    A contraindication applies until it is resolved, also after the end of its episode.
    """
    query = select(ContraindicationRow, EpisodeRow.side).join(EpisodeRow, isouter=True)
    query = query.where(ContraindicationRow.patient_id == episode.patient_id)
    return tuple(
        _printed(row)
        for row, side in session.execute(query.order_by(ContraindicationRow.noted_at))
        if row.episode_id in (None, episode.id) or (side == episode.side and _applied_during(row, episode))
    )


def _applied_during(row: ContraindicationRow, episode: EpisodeRow) -> bool:
    began_in_time = episode.closed_at is None or row.noted_at <= episode.closed_at
    return began_in_time and (row.resolved_at is None or row.resolved_at >= episode.opened_at)


def _printed(row: ContraindicationRow) -> PrintedContraindication:
    names = [field.name for field in fields(PrintedContraindication) if field.name != "needs_permission"]
    is_missing = kind_of(row.code).effect == "sign_off" and row.signed_off_at is None and row.resolved_at is None
    return PrintedContraindication(**{name: getattr(row, name) for name in names}, needs_permission=is_missing)


def _rom(assessments: Iterable[AssessmentRow], treated: str) -> tuple[RomSeries, ...]:
    """Return one series per direction, active before passive."""
    treated_side: dict[tuple[str, str, str], list[DatedValue]] = {}
    other: dict[tuple[str, str, str], DatedValue] = {}
    for assessment in assessments:
        for measured in assessment.rom:
            key = (measured.motion, measured.kind, measured.position)
            reading = DatedValue(assessment.assessed_at, measured.angle_deg)
            if measured.side == treated:
                treated_side.setdefault(key, []).append(reading)
            else:
                other[key] = reading

    def place(key: tuple[str, str, str]) -> tuple[int, str]:
        motion, kind, position = key
        return rom.place_of(motion, position), kind

    def reference(motion: str, position: str) -> float | None:
        measure = rom.measure_of(motion, position)
        return measure.reference_deg if measure else None

    return tuple(
        RomSeries(*key, tuple(treated_side[key]), other.get(key), reference(key[0], key[2]))
        for key in sorted(treated_side, key=place)
    )


def _pain(assessments: Iterable[AssessmentRow]) -> tuple[ScoreSeries, ...]:
    courses = []
    for name in PAINS:
        readings = tuple(
            DatedValue(assessment.assessed_at, score)
            for assessment in assessments
            if (score := getattr(assessment, f"pain_{name}")) is not None
        )
        if readings:
            courses.append(ScoreSeries(name, readings))
    return tuple(courses)


def _questionnaires(assessments: Sequence[AssessmentRow]) -> Iterator[QuestionnaireSeries]:
    """Yield the series of each questionnaire that has a total: the SPADI, then the others. One that only another version knows has none."""
    for definition in [SPADI, *(definition for definition in DEFINITIONS.values() if definition is not SPADI)]:
        readings = []
        for assessment in assessments:
            answers = assessment.spadi if definition is SPADI else assessment.questionnaires.get(definition.code)
            total = score(definition, answers).total if answers and definition.fits(answers) else None
            if total is not None:
                readings.append(DatedValue(assessment.assessed_at, total))
        if readings:
            yield _questionnaire(definition, tuple(readings))


def _questionnaire(definition: Definition, readings: tuple[DatedValue, ...]) -> QuestionnaireSeries:
    change = change_as_shown(readings[0].value, readings[-1].value)
    return QuestionnaireSeries(
        title=definition.title,
        lowest=definition.lowest_total,
        highest=definition.highest_total,
        better=definition.better,
        is_t_score=definition.total == "t_score",
        important=_threshold(definition.important),
        detectable=_threshold(definition.detectable),
        readings=readings,
        meaning=meaning_of(definition, change) if len(readings) > 1 else None,
    )


def _threshold(threshold: Threshold) -> PrintedThreshold:
    return PrintedThreshold(threshold.points, threshold.source, threshold.up_to)


def _sessions(session: DatabaseSession, episode_id: UUID) -> tuple[PrintedSession, ...]:
    """Return the sessions without their tracking data, because an episode may have a hundred sessions."""
    session_rows = session.execute(
        select(
            SessionRow.id, SessionRow.started_at, SessionRow.therapist, SessionRow.programme_version_id,
            SessionRow.stop_count, SessionRow.pain_before, SessionRow.pain_after, SessionRow.signed_at, SessionRow.simulated,
        )
        .where(SessionRow.episode_id == episode_id)
        .order_by(SessionRow.started_at, SessionRow.id)
    ).all()  # fmt: skip
    runs: dict[UUID, list[_Played]] = {}
    for run in session.execute(
        select(
            RunRow.session_id, RunRow.programme_position, RunRow.recording_id, RunRow.repetitions_done,
            RunRow.worst_rmse_deg, RunRow.outcome,
        )
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .where(SessionRow.episode_id == episode_id)
    ):  # fmt: skip
        played = _Played(
            run.programme_position, run.recording_id, run.repetitions_done or 0, run.worst_rmse_deg, run.outcome
        )
        runs.setdefault(run.session_id, []).append(played)
    versions = {session_row.programme_version_id for session_row in session_rows if session_row.programme_version_id}
    items: dict[UUID, list[ProgrammeItemRow]] = {}
    for item in session.scalars(select(ProgrammeItemRow).where(ProgrammeItemRow.version_id.in_(versions))):
        items.setdefault(item.version_id, []).append(item)
    return tuple(
        PrintedSession(
            session_row.started_at,
            session_row.therapist,
            *_planned_and_done(items.get(session_row.programme_version_id), runs.get(session_row.id, [])),
            session_row.stop_count,
            session_row.pain_before,
            session_row.pain_after,
            max((run.rmse_deg for run in runs.get(session_row.id, []) if run.rmse_deg is not None), default=None),
            session_row.signed_at is not None,
            session_row.simulated,
            any(run.outcome not in ("loaded", "unloaded") for run in runs.get(session_row.id, [])),
        )
        for session_row in session_rows
    )


def _planned_and_done(items: list[ProgrammeItemRow] | None, runs: list[_Played]) -> tuple[int | None, int]:
    """Return the planned and the completed repetitions, counted as in :mod:`kata.clinic.programmes.planned`: a run of another recording
    does not belong to the item.
    """
    if items is None:
        return None, sum(run.repetitions for run in runs)
    done = 0
    for item in items:
        runs_of_item = (run for run in runs if (run.position, run.recording_id) == (item.position, item.recording_id))
        done += min(item.repetitions, sum(run.repetitions for run in runs_of_item))
    return sum(item.repetitions for item in items), done


def _stops(session: DatabaseSession, episode_id: UUID) -> tuple[tuple[PrintedStop, int], ...]:
    """Return each cause of a stop with its newest sentence, most frequent cause first."""
    counted: dict[str, tuple[PrintedStop, set[UUID]]] = {}
    for run in session.execute(
        select(RunRow.session_id, RunRow.stop_code, RunRow.stop_message, RunRow.stop_key)
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .where(SessionRow.episode_id == episode_id, RunRow.stop_code.is_not(None))
        .order_by(RunRow.started_at)
    ):
        stop = PrintedStop(run.stop_code, run.stop_message or "", motor_of(run.stop_key))
        _, session_ids = counted.get(run.stop_code, (stop, set()))
        counted[run.stop_code] = (stop, session_ids | {run.session_id})
    causes = [(stop, len(session_ids)) for stop, session_ids in counted.values()]
    return tuple(sorted(causes, key=lambda cause: -cause[1]))
