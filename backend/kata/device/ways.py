"""Chooses the ways between the arm and a recording so that they stay within the limits of the arm's pose.

A setpoint beyond these limits is moved back inside. On a way that leads through them, it could jump where limits meet, and the
setpoint gate would cut torque.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Final

import numpy as np

from kata.device.range_override import RangeOverride
from kata.device.run import Run
from kata.device.run_limits import WAY_TOLERANCE_DEG
from kata.motion.approach import MinimumJerkMove, PathSequence, unidirectional_approach
from kata.motion.linkage import Floats
from kata.motion.path import Path, PathPoint
from kata.motion.trajectory import Trajectory

_ON_PATH_DEG: Final = 0.01
"""An arm that is this close to the recording needs no movement back to it."""


@dataclass(frozen=True)
class BackwardPath:
    """A recording from a place back to its start, with its present range and at its own speed. The arm rests at both ends."""

    trajectory: Trajectory
    range_override: RangeOverride
    from_s: float
    """Place on the recording at which the path begins."""
    ramp_s: float
    """Time from rest to the recording's own speed."""

    @property
    def duration_s(self) -> float:
        """Duration from the place to the start."""
        return self.from_s + self.ramp_s if self.from_s >= self.ramp_s else 2 * sqrt(self.from_s * self.ramp_s)

    def motion_at(self, time_s: float) -> PathPoint:
        """Return angles, speed and acceleration at ``time_s``. Before the start and after the end the arm is at rest."""
        duration_s = self.duration_s
        ramp_s, rate = min(self.ramp_s, duration_s / 2), 1 / self.ramp_s
        passed_s = min(max(time_s, 0.0), duration_s)
        left_s = duration_s - passed_s
        share = min(passed_s, left_s, ramp_s) * rate
        if passed_s < ramp_s:
            place_s, change = self.from_s - share * passed_s / 2, rate
        elif left_s < ramp_s:
            place_s, change = share * left_s / 2, -rate
        else:
            place_s, change = self.from_s - share * (passed_s - ramp_s / 2), 0.0
        angles, speed, acceleration = self.trajectory.motion_at(place_s)
        reduced = self.range_override.share
        return PathPoint(
            self.range_override.reduced_deg(angles),
            -reduced * share * speed,
            reduced * (share**2 * acceleration - change * speed),
        )


def approach_way(run: Run, here_deg: Floats) -> tuple[Path, float]:
    """Return the way from the arm at ``here_deg``, ``(5,)``, to the recording's start, and how far it leads outwards in deg.

    It passes the pose from which every axis arrives in its own direction, unless only the straight way stays within the limits.
    """
    start_deg, departure_deg = run.trajectory.start_deg, run.trajectory.departure_deg
    speed_deg_s = run.config.approach_speed_deg_s
    outwards_deg = run.way_outwards_deg(here_deg, start_deg + departure_deg, start_deg)
    if outwards_deg <= WAY_TOLERANCE_DEG:
        return unidirectional_approach(here_deg, start_deg, departure_deg, speed_deg_s), outwards_deg
    return MinimumJerkMove(here_deg, start_deg, speed_deg_s), run.way_outwards_deg(here_deg, start_deg)


def return_way(run: Run, here_deg: Floats) -> Path:
    """Return the way from the setpoint ``here_deg``, ``(5,)``, to the place where the return ends.

    If the straight way leads outwards, the arm goes back along the recording to its start first. From there the straight way
    stays within the limits; see :meth:`kata.device.run.Run.begin`.
    """
    assert run.return_to_deg is not None
    speed_deg_s = run.config.approach_speed_deg_s
    straight = MinimumJerkMove(here_deg, run.return_to_deg, speed_deg_s)
    if run.way_outwards_deg(here_deg, run.return_to_deg) <= WAY_TOLERANCE_DEG:
        return straight
    start_deg = run.trajectory.start_deg
    backwards = BackwardPath(run.trajectory, run.range_override, run.position_s, run.ramp_s)
    corners_deg = [here_deg, backwards.motion_at(0.0).angles_deg, run.range_override.reduced_deg(start_deg), start_deg]
    to_recording, to_whole_range = (
        [MinimumJerkMove(first, then, speed_deg_s)] if np.max(np.abs(then - first)) > _ON_PATH_DEG else []
        for first, then in (corners_deg[:2], corners_deg[2:])
    )
    return PathSequence(
        [*to_recording, backwards, *to_whole_range, MinimumJerkMove(start_deg, run.return_to_deg, speed_deg_s)]
    )
