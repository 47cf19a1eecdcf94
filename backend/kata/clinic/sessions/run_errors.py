"""Compare a run's journal with its motion. The figure worker runs this, so it does not import the database's tables.

Three motions are compared. The *taught* motion is the samples of the recording. The *requested* motion is the taught samples with the run's
range, speed and repetitions, before they are approximated for the drives. The *played* motion was measured. The tracking error is played
minus requested. The change by settings is requested minus taught. While the range was reduced during playback, the change is played minus
taught, because the journal does not contain the momentary range.
"""

import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kata.clinic.sessions import phases
from kata.device.journal import PHASE_PLAYING, PHASE_REDUCED_RANGE, Journal
from kata.motion.axes import Side
from kata.motion.edit import Motion
from kata.motion.linkage import Floats, OutOfReachError, pose_deg
from kata.motion.tracking import (
    Comparison,
    Tracking,
    angles_at,
    compare,
    compare_motions,
    error_figures,
    largest,
    wall_clock_s,
)

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _SampleTimes:
    """Positions of the arm. ``path_s`` and ``wall_s``: ``(m,)`` of compared samples; ``reduced_s``: ``(r,)`` with reduced range."""

    path_s: Floats
    wall_s: Floats
    reduced_s: Floats


@dataclass(frozen=True)
class _Angles:
    """Five angles of motors or poses: ``(n, 5)`` of the requested motion, and ``(m, 5)`` and ``(r, 5)`` at :class:`_SampleTimes`."""

    requested: Floats
    taught: Floats
    played: Floats
    reduced: Floats

    def poses(self, side: Side) -> "_Angles":
        """Return the poses of these motor angles.

        :raises OutOfReachError: when no scapula can have such a pose.
        """
        requested = pose_deg(self.requested, side)
        taught = requested if self.taught is self.requested else pose_deg(self.taught, side)
        return _Angles(
            requested, taught, pose_deg(self.played, side), pose_deg(self.reduced, side) if len(self.reduced) else self.reduced
        )  # fmt: skip


@dataclass(frozen=True)
class RunErrors:
    """Columns by name: of the run, of its motors and of its motions. ``comparison`` is that of the motors, or None if nothing was played
    with the requested range.
    """

    run: dict[str, Any]
    comparison: Comparison | None = None
    motors: list[dict[str, Any]] = field(default_factory=list)
    motions: list[dict[str, Any]] = field(default_factory=list)


def compare_run(run_id: str, journal: Journal, requested: Motion, taught: Motion, side: Side) -> RunErrors:
    """Compare a run in which the arm moved along its path.

    :param taught: the taught samples on the clock of ``requested`` (:func:`kata.motion.edit.without_range`).
    """
    playing, reduced = journal.phase == PHASE_PLAYING, journal.phase == PHASE_REDUCED_RANGE
    moving = playing | reduced
    compared_percent = 100.0 * np.count_nonzero(playing) / np.count_nonzero(moving)
    if not np.any(playing):
        return RunErrors({"compared_percent": compared_percent})
    wall_s = _wall_clock_s(journal, moving)[playing]
    times = _SampleTimes(journal.path_s[playing], wall_s, journal.path_s[reduced])
    measured = journal.measured_deg.astype(np.float64)
    motors = _Angles(requested.angles_deg, taught.angles_deg, measured[playing], measured[reduced])
    compared = compare(requested.times_s, motors.requested, times.path_s, motors.played, journal.torque_nm[playing])
    tracking = [
        {"motor": motor.motor, "torque_peak_nm": motor.torque_peak_nm}
        | _columns(motor)
        | _beside(requested.times_s, times, motors, motor.motor - 1)
        for motor in compared.motors
    ]
    try:
        motions = _motions(requested.times_s, times, motors.poses(side))
    except OutOfReachError as error:
        log.warning("run %s is compared by motors only: %s", run_id, error)
        motions = []
    phases.widen(tracking, motions, journal.measured_deg[reduced], side)
    run = {
        "compared_percent": compared_percent,
        "clock_offset_s": largest(times.wall_s - times.path_s),
        "samples": compared.samples,
    }
    return RunErrors(run, compared, tracking, motions)


def _wall_clock_s(journal: Journal, moving: NDArray[np.bool_]) -> Floats:
    return wall_clock_s((journal.t_ns - journal.t_ns[0]) / 1e9, journal.path_s, moving)


def _motions(times_s: Floats, times: _SampleTimes, poses: _Angles) -> list[dict[str, Any]]:
    """Compare the basic motions."""
    return [
        {"motion": motion.motion.number} | _columns(motion) | _beside(times_s, times, poses, motion.motion.axis - 1)
        for motion in compare_motions(times_s, poses.requested, times.path_s, poses.played)
    ]


def _columns(tracking: Tracking) -> dict[str, Any]:
    """Return the columns of :class:`~kata.clinic.sessions.tables.MotorTrackingRow` that motors and motions share."""
    return {
        "peak_deg": tracking.peak_deg,
        "peak_at_s": tracking.peak_at_s,
        "rmse_deg": tracking.rmse_deg,
        "start_deg": tracking.start_deg,
        "lag_ms": tracking.lag_ms,
        "taught_min_deg": tracking.taught.min_deg,
        "taught_max_deg": tracking.taught.max_deg,
        "played_min_deg": tracking.played.min_deg,
        "played_max_deg": tracking.played.max_deg,
        "taught_smoothness": tracking.taught_smoothness,
        "played_smoothness": tracking.played_smoothness,
    }


def _beside(times_s: Floats, times: _SampleTimes, angles: _Angles, axis: int) -> dict[str, Any]:
    """Return the columns of one angle that are shown beside its errors: errors on the wall clock, and the change by settings."""
    requested, taught = angles.requested[:, axis], angles.taught[:, axis]
    wall = error_figures(times.wall_s, angles.played[:, axis] - angles_at(times_s, requested, times.wall_s))
    change = angles_at(times_s, requested - taught, times.path_s)
    if len(times.reduced_s):
        reduced = angles.reduced[:, axis] - angles_at(times_s, taught, times.reduced_s)
        change = np.concatenate([change, reduced])
    return {"wall_peak_deg": wall.peak_deg, "wall_rmse_deg": wall.rmse_deg, "change_deg": largest(change)}
