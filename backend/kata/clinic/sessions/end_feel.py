"""Begin end-feel runs, and calculate their results. The caller commits. docs/explanation/end-feel.md defines method and figures.

A baseline is played with a test weight in the fixers, and its test with the patient's arm on the same path. Both are runs of the patient's
session: they have the same checks, limits and stops as a playback.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final, Literal
from uuid import UUID

import numpy as np
from msgspec import structs
from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions.tables import EndFeelRow, RunRow
from kata.database import arrays
from kata.device.config import StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS, EndFeel
from kata.device.journal import PHASE_PLAYING, Journal
from kata.errors import ProblemError, not_found
from kata.motion import end_feel
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.end_feel import Figures, GuardingError, TooFewWaysError, TorqueAngleCurve
from kata.motion.linkage import Floats
from kata.motion.shoulder import motion_of_motor_4
from kata.types import side_of

log = logging.getLogger(__name__)

Kind = Literal["baseline", "test", "stretch"]
LEAST_RANGE_DEG: Final = 20.0
"""A motion with less range has no free part in which the arm can be weighed."""
_FURTHER_DEG: Final = (15.0, 10.0, 5.0, 0.0)
"""Distances that the path may go beyond the recorded end, the largest first. The limits decide."""
_FROM_LIMIT_DEG: Final = 1.0
"""Distance that the path keeps from the end of the apparatus' range."""
_SHORT_DEG: Final = 3.0
"""Distance before the end of the path at which a baseline may end, because friction and weight hold the arm back."""
_WEIGHED_AFTER_DEG: Final = 4.0
_WEIGHED_SHARE: Final = 0.5
"""The arm is weighed from :data:`_WEIGHED_AFTER_DEG` after the start to this share of the recorded range, in which the shoulder is free."""
_BASELINE_SHARE: Final = 0.9
"""Share of the level's torque at which a baseline turns back."""
_BEYOND_WEIGHED_DEG: Final = 2.0
"""A stretch goes at least this far beyond the part in which the arm is weighed."""
_ROWS: Final = 400
"""Places on the path at which the device gets the expected torques."""
_COLUMNS: Final = (
    arrays.SampleColumn("place_deg", "deg", 1e-3),
    arrays.SampleColumn("out_nm", "Nm", 1e-4),
    arrays.SampleColumn("back_nm", "Nm", 1e-4),
)


@dataclass(frozen=True)
class EndFeelRequest:
    """A requested baseline, test or stretch."""

    session_id: UUID
    recording_id: UUID
    kind: Kind
    resistance_level: int
    torque_nm: float
    """The chosen torque of a test."""
    speed_deg_s: float
    hold_s: float = 0.0
    """Time for which a stretch holds the torque in each repetition."""
    repetitions: int = end_feel.STRETCH_REPETITIONS
    """Repetitions of a stretch."""
    largest_deg: float | None = None
    """Largest angle of the motor in a stretch; None: only the limits apply."""


@dataclass(frozen=True)
class OutwardPath:
    """The outward path of a test along a recorded motion."""

    motion: Motion
    motor: int
    side: Side
    outward: int
    further_deg: float
    recorded_deg: float
    """Recorded range of the motor."""

    @property
    def angles_deg(self) -> Floats:
        """Return the motor's outward angles."""
        angles: Floats = self.outward * self.motion.angles_deg[:, self.motor - 1]
        return angles

    @property
    def number(self) -> int:
        """Return the number of the basic motion."""
        if self.motor == 4:
            return int(motion_of_motor_4(self.motion.angles_deg[-1, 2]))
        return next(basic.number for basic in BASIC_MOTIONS if basic.motors == (self.motor,))

    @property
    def weighed_deg(self) -> tuple[float, float]:
        """Return the outward angles between which the shoulder is free."""
        start = float(self.angles_deg[0])
        return start + _WEIGHED_AFTER_DEG, start + _WEIGHED_SHARE * self.recorded_deg

    def postures_deg(self, places_deg: Floats) -> Floats:
        """Return all motors' angles at outward angles of the measured motor, ``(n, 5)``."""
        columns = self.motion.angles_deg.T
        return np.column_stack([np.interp(places_deg, self.angles_deg, column) for column in columns])

    def along(self, places_deg: Floats, torque_nm: Floats) -> tuple[float, ...]:
        """Return outward torques at places as the motor's torque on the path, evenly spaced."""
        at_s = np.linspace(0.0, self.motion.duration_s, _ROWS)
        angles = np.interp(at_s, self.motion.times_s, self.angles_deg)
        return tuple((self.outward * np.interp(angles, places_deg, torque_nm)).tolist())


def outward_path_of(taught: Motion, side: Side, speed_deg_s: float, further_deg: float = 0.0) -> OutwardPath:
    """Return the outward path along a recorded motion.

    :raises ProblemError: 409 when the recording moves no motor of the shoulder joint far enough.
    """
    if max(float(np.ptp(taught.angles_deg[:, motor - 1])) for motor in end_feel.MOTORS) < LEAST_RANGE_DEG:
        raise ProblemError(
            409,
            "too_short_for_end_feel",
            texts.END_FEEL_TOO_SHORT(least_deg=LEAST_RANGE_DEG),
            texts.CHOOSE_WIDER_MOTION(),
        )
    motion, motor = end_feel.way_out(taught, speed_deg_s, further_deg)
    gone_deg = float(motion.angles_deg[-1, motor - 1] - motion.angles_deg[0, motor - 1])
    return OutwardPath(motion, motor, side, 1 if gone_deg > 0 else -1, further_deg, abs(gone_deg) - further_deg)


def farthest_deg(session: DatabaseSession, request: EndFeelRequest, station: str, today: datetime) -> float:
    """Return how far beyond the recorded end a path may go. A test goes no farther than its baseline: the weight is unknown there."""
    if request.kind == "baseline":
        return math.inf
    row = baseline_of(session, request.recording_id, station, request.speed_deg_s, today)
    return row.further_deg if row else math.inf


def longest_outward_path(
    taught: Motion, allowed: DoctorLimits, config: StationConfig, speed_deg_s: float, farthest_deg: float
) -> OutwardPath:
    """Return the path that goes farthest beyond the recorded end within the limits of apparatus and doctor.

    :param farthest_deg: :func:`farthest_deg`.
    :raises ProblemError: 409 as in :func:`outward_path_of`; 422 when even the recorded motion exceeds a limit of the doctor.
    """
    refused: ProblemError | None = None
    for further_deg in _FURTHER_DEG:
        if further_deg > farthest_deg:
            continue
        path = outward_path_of(taught, allowed.side, speed_deg_s, further_deg)
        axis = config.axes[path.motor - 1]
        end_deg = float(path.motion.angles_deg[-1, path.motor - 1])
        inside = axis.min_deg + _FROM_LIMIT_DEG <= end_deg <= axis.max_deg - _FROM_LIMIT_DEG
        if further_deg and not inside:
            continue
        try:
            allowed.check_path(path.motion, "smooth")
        except ProblemError as error:
            refused = error
        else:
            return path
    assert refused is not None
    raise refused


def up_to(path: OutwardPath, largest_deg: float | None) -> OutwardPath:
    """Return the path up to the largest angle of the motor.

    :raises ProblemError: 409 when the path would end before the arm has been weighed.
    """
    if largest_deg is None:
        return path
    kept = path.angles_deg <= path.outward * largest_deg
    least_deg = path.weighed_deg[1] + _BEYOND_WEIGHED_DEG
    if np.all(kept):
        return path
    if path.outward * largest_deg < least_deg:
        raise ProblemError(
            409,
            "largest_angle_too_small",
            texts.STRETCH_ANGLE_TOO_SMALL(motor=path.motor, least_deg=path.outward * least_deg),
            texts.CHOOSE_LARGER_ANGLE(),
        )
    return replace(path, motion=Motion(path.motion.times_s[kept], path.motion.angles_deg[kept]))


@dataclass(frozen=True)
class Prepared:
    """An end-feel run that can be stored and loaded."""

    path: OutwardPath
    test: EndFeel
    baseline_run_id: UUID | None


def prepare(
    session: DatabaseSession, request: EndFeelRequest, path: OutwardPath, config: StationConfig, today: datetime
) -> Prepared:
    """Return the run's path, the device's test and the run of its baseline.

    :param today: beginning of today. A baseline must be newer.
    :raises ProblemError: 409 when a test has no baseline of today at this station.
    """
    if request.kind == "baseline":
        strong_nm = (
            _BASELINE_SHARE * config.axes[path.motor - 1].max_torque_nm * request.resistance_level / RESISTANCE_LEVELS
        )
        return Prepared(
            path, EndFeel(motor=path.motor, torque_nm=strong_nm, expected_nm=(0.0, 0.0), repetitions=1), None
        )
    row = baseline_of(session, request.recording_id, config.name, request.speed_deg_s, today)
    if row is None:
        raise ProblemError(409, "no_baseline_today", texts.NO_BASELINE_TODAY(), texts.MEASURE_BASELINE_FIRST())
    baseline = _curve(row)
    growth = end_feel.arm_growth(path.postures_deg(baseline.places_deg), path.motor, path.side, path.outward)
    from_deg, to_deg = (angle - float(path.angles_deg[0]) for angle in path.weighed_deg)
    test = EndFeel(
        motor=path.motor,
        torque_nm=request.torque_nm,
        expected_nm=path.along(baseline.places_deg, baseline.out_nm),
        back_nm=path.along(baseline.places_deg, baseline.back_nm),
        arm_nm=tuple(path.along(baseline.places_deg, column) for column in growth.T),
        weighed_s=(from_deg / request.speed_deg_s, to_deg / request.speed_deg_s),
    )
    if request.kind == "stretch":
        test = structs.replace(test, hold_s=request.hold_s, repetitions=request.repetitions)
    return Prepared(path, test, row.run_id)


def baseline_of(
    session: DatabaseSession, recording_id: UUID, station: str, speed_deg_s: float, since: datetime
) -> EndFeelRow | None:
    """Return the newest measured baseline of a recording at a station, or None."""
    query = (
        select(EndFeelRow)
        .join(RunRow, RunRow.id == EndFeelRow.run_id)
        .where(
            EndFeelRow.kind == "baseline",
            EndFeelRow.station == station,
            EndFeelRow.speed_deg_s == speed_deg_s,
            EndFeelRow.curve.is_not(None),
            RunRow.recording_id == recording_id,
            RunRow.started_at >= since,
        )
        .order_by(RunRow.started_at.desc())
    )
    return session.scalars(query).first()


def add(session: DatabaseSession, run: RunRow, request: EndFeelRequest, prepared: Prepared, station: str) -> None:
    """Store what an end-feel run asks."""
    path = prepared.path
    stretches = request.kind == "stretch"
    run.end_feel = EndFeelRow(
        run_id=run.id,
        kind=request.kind,
        station=station,
        motion=path.number,
        motor=path.motor,
        outward=path.outward,
        speed_deg_s=request.speed_deg_s,
        further_deg=path.further_deg,
        torque_nm=prepared.test.torque_nm,
        baseline_run_id=prepared.baseline_run_id,
        hold_s=request.hold_s if stretches else None,
        repetitions=request.repetitions if stretches else None,
        largest_deg=float(path.motion.angles_deg[-1, path.motor - 1]) if stretches else None,
    )
    session.flush()


def complete(session: DatabaseSession, run: RunRow, row: EndFeelRow, journal: Journal) -> None:
    """Calculate the result of an end-feel run that has ended. The device counts the time of a stretch."""
    if row.kind == "stretch":
        if journal.end:
            row.held_s, row.target_nm = journal.end.held_s, journal.end.target_nm
        return
    playing = journal.phase == PHASE_PLAYING
    axis = row.motor - 1
    curves = end_feel.curves(
        journal.path_s[playing],
        journal.measured_deg[playing][:, axis],
        journal.torque_nm[playing][:, axis],
        row.outward,
    )
    try:
        if row.kind == "baseline":
            _complete_baseline(session, run, row, end_feel.baseline_curve(curves))
        else:
            _measure(session, run, row, curves)
    except GuardingError as error:
        row.unmeasured, row.disagreement_nm = "guarding", error.disagreement_nm
    except TooFewWaysError:
        row.unmeasured = "too_few_ways"


def _complete_baseline(session: DatabaseSession, run: RunRow, row: EndFeelRow, curve: TorqueAngleCurve) -> None:
    """Store the curve of a baseline that reached the end of the path. A test must not go where the weight is unknown."""
    if curve.places_deg[-1] < _outward_path(session, run, row).angles_deg[-1] - _SHORT_DEG:
        row.unmeasured = "too_few_ways"
    else:
        row.curve = _encoded(curve)


def _outward_path(session: DatabaseSession, run: RunRow, row: EndFeelRow) -> OutwardPath:
    """Return the outward path of a stored run."""
    samples = recordings.samples(session, run.recording_id)
    taught = Motion(samples.times_s, samples.angles_deg)
    return outward_path_of(taught, side_of(run.recording.side), row.speed_deg_s, row.further_deg)


def _measure(session: DatabaseSession, run: RunRow, row: EndFeelRow, curves: Sequence[TorqueAngleCurve]) -> None:
    """:raises GuardingError, TooFewWaysError: as in :func:`kata.motion.end_feel.measured`."""
    base = session.get(EndFeelRow, row.baseline_run_id)
    if base is None or base.curve is None:
        log.warning("the baseline of run %s is missing", run.id)
        raise TooFewWaysError("no baseline")
    baseline = _curve(base)
    path = _outward_path(session, run, row)
    growth = end_feel.arm_growth(path.postures_deg(baseline.places_deg), row.motor, path.side, row.outward)
    result = end_feel.measured(curves, baseline, growth, path.weighed_deg, row.torque_nm)
    row.unmeasured, row.disagreement_nm = result.unmeasured, result.disagreement_nm
    row.curve = _encoded(result.curve)
    if result.figures and result.interval:
        for name in Figures._fields:
            setattr(row, name, getattr(result.figures, name))
            setattr(row, f"interval_{name}", getattr(result.interval, name))


def of_run(session: DatabaseSession, run_id: UUID) -> tuple[RunRow, EndFeelRow]:
    """Return an end-feel run.

    :raises ProblemError: 404.
    """
    run = session.get(RunRow, run_id)
    if run is None or run.end_feel is None:
        raise not_found(texts.END_FEEL_NOT_FOUND)
    return run, run.end_feel


def curve_of(row: EndFeelRow) -> TorqueAngleCurve | None:
    """Return the stored curve, or None if there is none or it is damaged."""
    try:
        return _curve(row) if row.curve else None
    except arrays.UnreadableError as error:
        log.warning("the curve of run %s is ignored: %s", row.run_id, error)
        return None


def _curve(row: EndFeelRow) -> TorqueAngleCurve:
    assert row.curve is not None
    columns = arrays.decode(row.curve)
    return TorqueAngleCurve(columns["place_deg"], columns["out_nm"], columns["back_nm"])


def _encoded(curve: TorqueAngleCurve) -> bytes:
    columns = {"place_deg": curve.places_deg, "out_nm": curve.out_nm, "back_nm": curve.back_nm}
    return arrays.encode(columns, _COLUMNS)
