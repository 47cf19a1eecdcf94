"""Read end-feel tests: results, curves, and what can be measured in a session."""

import csv
from collections.abc import Sequence
from datetime import UTC, datetime, tzinfo
from io import StringIO
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import end_feel, service
from kata.clinic.sessions.end_feel_figure import DrawnCurve, draw
from kata.clinic.sessions.end_feel_schemas import (
    EndFeelCurves,
    EndFeelFigures,
    EndFeelGuide,
    EndFeelMotion,
    EndFeelRecord,
    StretchRecord,
)
from kata.clinic.sessions.tables import EndFeelRow, RunRow, SessionRow
from kata.errors import ProblemError
from kata.messages import sent_key
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.edit import Motion
from kata.motion.end_feel import SPEED_DEG_S, Figures
from kata.types import side_of

MOST_EARLIER: Final = 4
"""Most earlier curves in a figure."""
_MOST_RECORDINGS: Final = 12
_LONGEST_S: Final = 300.0
"""The samples of a longer recording are not read to see which motor moves."""


def as_result(run: RunRow, visit: SessionRow) -> EndFeelRecord:
    """Return the response model of an end-feel run."""
    row = run.end_feel
    assert row is not None
    basic = BASIC_MOTIONS[row.motion - 1]
    return EndFeelRecord(
        run_id=run.id,
        session_id=run.session_id,
        recording_id=run.recording_id,
        recording_name=run.recording.name,
        kind=row.kind,
        side=side_of(run.recording.side),
        motion=row.motion,
        name=basic.name,
        name_key=sent_key(basic.name),
        motor=row.motor,
        started_at=run.started_at,
        outcome=run.outcome,
        simulated=bool(visit.simulated),
        speed_deg_s=row.speed_deg_s,
        torque_nm=row.torque_nm,
        baseline_run_id=row.baseline_run_id,
        unmeasured=row.unmeasured,
        figures=_figures(row),
        interval=_interval(row),
        disagreement_nm=row.disagreement_nm,
        stretch=_stretch(row),
    )


def _stretch(row: EndFeelRow) -> StretchRecord | None:
    if row.hold_s is None or row.repetitions is None or row.largest_deg is None:
        return None
    return StretchRecord(
        hold_s=row.hold_s,
        repetitions=row.repetitions,
        largest_deg=row.largest_deg,
        held_s=row.held_s,
        target_nm=row.target_nm,
    )


def _figures(row: EndFeelRow) -> EndFeelFigures | None:
    if row.range_deg is None:
        return None
    values: dict[str, Any] = {name: getattr(row, name) for name in Figures._fields}
    for name in ("range_deg", "onset_deg"):
        values[name] *= row.outward
    return EndFeelFigures(**values)


def _interval(row: EndFeelRow) -> EndFeelFigures | None:
    if row.range_deg is None:
        return None
    return EndFeelFigures(**{name: getattr(row, f"interval_{name}") for name in Figures._fields})


def guide(session: DatabaseSession, session_id: UUID, station: str, today: datetime) -> EndFeelGuide:
    """Return what can be measured in a session at a station.

    :raises ProblemError: 404.
    """
    visit = service.get(session, session_id)
    query = (
        select(RecordingRow)
        .where(
            RecordingRow.patient_id == visit.patient_id,
            RecordingRow.archived_at.is_(None),
            RecordingRow.duration_s <= _LONGEST_S,
        )
        .order_by(RecordingRow.taught_at.desc(), RecordingRow.take.desc())
        .limit(_MOST_RECORDINGS)
    )
    if visit.episode:
        query = query.where(RecordingRow.side == visit.episode.side)
    motions = (_motion(session, visit, row, station, today) for row in session.scalars(query))
    return EndFeelGuide(speed_deg_s=SPEED_DEG_S, motions=[guided for guided in motions if guided])


def _motion(
    session: DatabaseSession, visit: SessionRow, recording: RecordingRow, station: str, today: datetime
) -> EndFeelMotion | None:
    side = side_of(recording.side)
    try:
        samples = recordings.samples(session, recording.id)
        path = end_feel.outward_path_of(Motion(samples.times_s, samples.angles_deg), side, SPEED_DEG_S)
    except ProblemError:
        # Damaged samples, or a motion without an end-feel.
        return None
    basic = BASIC_MOTIONS[path.number - 1]
    baseline = end_feel.baseline_of(session, recording.id, station, SPEED_DEG_S, today)
    of_recording = [run for run in visit.runs if run.recording_id == recording.id]
    tests = [run for run in of_recording if _is(run, "test")]
    stretches = [run for run in of_recording if _is(run, "stretch")]
    return EndFeelMotion(
        recording_id=recording.id,
        recording_name=recording.name,
        motion=path.number,
        name=basic.name,
        name_key=sent_key(basic.name),
        motor=path.motor,
        side=side,
        baseline_run_id=baseline.run_id if baseline else None,
        end_deg=float(path.motion.angles_deg[-1, path.motor - 1]),
        tests=[as_result(run, visit) for run in reversed(tests)],
        stretches=[as_result(run, visit) for run in reversed(stretches)],
    )


def _is(run: RunRow, kind: end_feel.Kind) -> bool:
    return run.end_feel is not None and run.end_feel.kind == kind


def curves(session: DatabaseSession, run_id: UUID, zone: tzinfo) -> EndFeelCurves:
    """Return a test with its curve, earlier ones and that of the other side. ``zone``: the clinic's time zone.

    :raises ProblemError: 404.
    """
    run, row = end_feel.of_run(session, run_id)
    visit = service.get(session, run.session_id)
    if row.kind != "test":
        return EndFeelCurves(
            result=as_result(run, visit), earlier=[], other_side=None, figure=_figure([(run, row)], [], zone)
        )
    side = run.recording.side
    same = measured_before(session, visit, row.motion, run.started_at)
    earlier = [(other_run, other) for other_run, other in same if other_run.recording.side == side][:MOST_EARLIER]
    beside = [(other_run, other) for other_run, other in same if other_run.recording.side != side][:1]
    return EndFeelCurves(
        result=as_result(run, visit),
        earlier=[as_result(other_run, visit_of) for other_run, visit_of in earlier],
        other_side=as_result(*beside[0]) if beside else None,
        figure=_figure(
            [(run, row), *((other_run, other_run.end_feel) for other_run, _ in earlier)],
            [other_run for other_run, _ in beside],
            zone,
        ),
    )


def measured_before(
    session: DatabaseSession, visit: SessionRow, motion: int, before: datetime
) -> Sequence[tuple[RunRow, SessionRow]]:
    """Return the patient's measured tests of a motion on both sides, newest first. A simulated test is only compared with simulated ones."""
    query = (
        select(RunRow, SessionRow)
        .join(EndFeelRow, EndFeelRow.run_id == RunRow.id)
        .join(SessionRow, SessionRow.id == RunRow.session_id)
        .where(
            SessionRow.patient_id == visit.patient_id,
            SessionRow.simulated == bool(visit.simulated),
            EndFeelRow.kind == "test",
            EndFeelRow.motion == motion,
            EndFeelRow.range_deg.is_not(None),
            RunRow.started_at < before,
        )
        .order_by(RunRow.started_at.desc())
    )
    return [(run, of) for run, of in session.execute(query)]


def _figure(
    own_runs: Sequence[tuple[RunRow, EndFeelRow | None]], beside: Sequence[RunRow], zone: tzinfo
) -> dict[str, Any] | None:
    curves = [curve for run, row in own_runs if row and (curve := _drawn_curve(run, row, zone))]
    other = [curve for run in beside if run.end_feel and (curve := _drawn_curve(run, run.end_feel, zone))]
    if not curves or curves[0].run_id != own_runs[0][0].id:
        return None
    return draw(curves, other)


def _drawn_curve(run: RunRow, row: EndFeelRow, zone: tzinfo) -> DrawnCurve | None:
    curve = end_feel.curve_of(row)
    if curve is None:
        return None
    angles = np.round(row.outward * curve.places_deg, 2)
    columns = (np.round(values, 3).tolist() for values in (curve.out_nm, curve.back_nm, curve.mean_nm))
    return DrawnCurve(run.id, run.started_at.astimezone(zone).date(), angles.tolist(), *columns)


def as_csv(session: DatabaseSession, run_id: UUID) -> str:
    """Return the torque-angle curve of a test as CSV. For a simulated apparatus it also has the column ``simulated``.

    :raises ProblemError: 404; 409 when there is no curve.
    """
    run, row = end_feel.of_run(session, run_id)
    # The table contains no day.
    curve = _drawn_curve(run, row, UTC)
    if curve is None:
        raise ProblemError(409, "no_curve", texts.END_FEEL_NO_CURVE(), texts.MEASURE_AGAIN())
    simulated = bool(service.get(session, run.session_id).simulated)
    columns = {
        "angle_deg": curve.angles_deg,
        "torque_out_nm": curve.out_nm,
        "torque_back_nm": curve.back_nm,
        "torque_mean_nm": curve.mean_nm,
    }
    buffer = StringIO()
    writer = csv.writer(buffer)
    writer.writerow([*columns, *(["simulated"] if simulated else [])])
    for values in zip(*columns.values(), strict=True):
        writer.writerow([*values, *(["true"] if simulated else [])])
    return buffer.getvalue()
