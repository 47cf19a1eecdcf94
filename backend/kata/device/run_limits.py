"""Limits setpoints and measured angles of one run. The limits are wider while an arm that starts outside approaches."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from kata.device.cycle_state import Limits
from kata.motion.linkage import Floats
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import POSE_ROUNDING_DEG

SETTLE_S: Final = 1.0
"""Time that the arm has to come within the patient's limits after the approach's path has ended. Then the limits apply in any
case, and an arm outside them is a fault.
"""
_INSIDE_SHARE: Final = 0.25
"""Share of the limit tolerance within which an arm counts as inside. A fault begins at twice this distance, half of the tolerance, so
that lag and noise of a drive do not cause a fault when the limits tighten.
"""

PATH_TOLERANCE_DEG: Final = 0.05
"""A path may exceed the limits by this much, and by about 0.01 deg more between the poses that are checked."""
_PATH_STEP_DEG: Final = 1.0
"""Distance between two poses at which a path is checked, measured at the motor that moves farthest."""


class RunLimits:
    """The intersection of the mechanism's and the patient's limits, for each motor and for the pose of the arm. At the start of
    the approach the limits are extended to include the arm. During the approach they only move inwards.
    """

    def __init__(self, mechanism_deg: Limits, patients_deg: Limits, tolerance_deg: float, gate: PoseGate) -> None:
        """Start with the tight limits. ``patients_deg``: empty for none. ``tolerance_deg``: distance beyond the mechanism's
        range that a measured angle may have.
        """
        self._gate = gate
        self.beyond_deg = 0.0
        """Distance that a setpoint may be beyond the limits of the pose. It is above 0 only while the limits are widened."""
        self.tight_deg = mechanism_deg
        if patients_deg:
            self.tight_deg = tuple(
                (max(low, patients_low), min(high, patients_high))
                for (low, high), (patients_low, patients_high) in zip(mechanism_deg, patients_deg, strict=True)
            )
        self.now_deg = self.tight_deg
        self._near_deg = _INSIDE_SHARE * tolerance_deg
        self._settling_s = 0.0

    @property
    def widened(self) -> bool:
        """True while the limits are wider than the tight limits (during the approach)."""
        return self.now_deg is not self.tight_deg

    def widen(self, here_deg: Sequence[float]) -> None:
        """Extend the limits to the arm's present angles."""
        self.now_deg = tuple(
            (min(low, angle), max(high, angle)) for (low, high), angle in zip(self.tight_deg, here_deg, strict=True)
        )
        self.beyond_deg = max(0.0, self._gate.beyond_deg(here_deg))

    def path_excess_deg(self, *corners_deg: Floats) -> float:
        """Return by how many degrees a path with straight parts between ``corners_deg``, each ``(5,)``, exceeds the limits of the pose.

        A path that begins outside may only lead inwards. A path of 100 deg takes about a millisecond.
        """
        excess_deg, level_deg = 0.0, math.inf
        for here_deg, next_deg in pairwise(corners_deg):
            for pose in _poses_between(here_deg, next_deg):
                beyond_deg = max(0.0, self._gate.beyond_deg(pose))
                excess_deg = max(excess_deg, beyond_deg - level_deg)
                level_deg = min(level_deg, beyond_deg)
        return excess_deg

    def entry_deg(self, here_deg: Floats, start_deg: Floats) -> Floats:
        """Return the pose ``(5,)`` at which the straight path from ``here_deg`` to a recording's start comes inside the tight limits."""
        inside = (pose for pose in _poses_between(here_deg, start_deg) if self.are_inside(pose))
        return np.array(next(inside, start_deg))

    def tighten(self, *poses_deg: Sequence[float]) -> None:
        """Move widened limits inwards, to the pose that is farthest outside. They never move outwards."""
        places = zip(self.now_deg, self.tight_deg, *poses_deg, strict=True)
        self.now_deg = tuple(
            (max(low, min(tight_low, *angles)), min(high, max(tight_high, *angles)))
            for (low, high), (tight_low, tight_high), *angles in places
        )
        if self.beyond_deg > 0.0:
            further_deg = max(map(self._gate.beyond_deg, poses_deg))
            self.beyond_deg = max(0.0, min(self.beyond_deg, further_deg))

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Advance the time after the approach by ``dt_s``. Return True once the tight limits apply.

        They apply when the setpoint is inside them and either the arm is inside or :data:`SETTLE_S` has passed.
        """
        self._settling_s += dt_s
        settled = self._settling_s >= SETTLE_S or self.are_inside(measured_deg, self._near_deg)
        if not (settled and self.are_inside(setpoint_deg)):
            return False
        self.now_deg, self.beyond_deg = self.tight_deg, 0.0
        return True

    def are_inside(self, angles_deg: Sequence[float], tolerance_deg: float = 0.0) -> bool:
        """Return True if the motors' angles and their pose are within the tight limits."""
        places = zip(angles_deg, self.tight_deg, strict=True)
        within = all(low - tolerance_deg <= angle <= high + tolerance_deg for angle, (low, high) in places)
        return within and self._gate.beyond_deg(angles_deg) <= tolerance_deg + POSE_ROUNDING_DEG


def _poses_between(here_deg: Floats, next_deg: Floats) -> list[list[float]]:
    difference_deg = next_deg - here_deg
    steps = max(1, math.ceil(float(np.max(np.abs(difference_deg))) / _PATH_STEP_DEG))
    poses: list[list[float]] = (here_deg + np.linspace(0.0, 1.0, steps + 1)[:, None] * difference_deg).tolist()
    return poses
