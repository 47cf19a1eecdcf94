"""Range override: reduces the range while a recording plays, and slowly restores it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.device.movement import longest_step
from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.trajectory import Trajectory

REDUCTION_STEP: Final = 0.1
"""Share of the full range that one request removes."""
MIN_SHARE: Final = 0.2
"""The smallest share, unless the recording's :attr:`~kata.motion.trajectory.Trajectory.least_share` is greater."""
RECOVERY_DEG: Final = 2.5
"""Increase of the range in each repetition, measured at the motor with the largest range. It is the same step as in a
warm-up.
"""
_MAX_RATE_PER_S: Final = 0.25
"""Highest rate of change of the share, in 1/s. One step takes less than 1 s. At 60 deg from rest the rate is 15 deg/s."""
_MAX_RATE_DEG_S: Final = 15.0
"""Highest speed that the change of range adds to a motor's own speed. It has the value of the default
of ``StationConfig.approach_speed_deg_s`` and need not follow it."""
_MAX_ACCELERATION_PER_S2: Final = 1.0
"""Highest acceleration of the share, in 1/s^2. At 60 deg from rest this is 60 deg/s^2."""


@dataclass
class RangeOverride:
    """The share of a recording's range that is played, counted from the recording's rest posture.

    A smaller share moves every motor nearer to that posture and none farther from it. If the range is reduced near rest, the
    arm is not raised. The end far from rest, where the patient feels pain, is reduced most.

    The share changes only while the arm moves along the path, so an arm that is held does not move. The range recovers after a
    whole repetition without another request, and only during forward movement.
    """

    trajectory: Trajectory
    repetition_s: float
    """Period of the motion on the path."""
    max_speed_deg_s: Floats
    """``(5,)`` speed limits. A change of the share never makes a motor exceed its limit."""
    share: float = 1.0
    """The present share. 1 is the range of the loaded recording."""

    def __post_init__(self) -> None:
        self._wanted = self.share
        self.least_share = max(MIN_SHARE, float(self.trajectory.least_share))
        """The range cannot be reduced below this share."""
        self._rate_s = 0.0
        self._since_s = math.inf
        """Time on the path since the last request."""
        self._recovery_s = (
            RECOVERY_DEG / max(float(np.max(self.trajectory.reach_deg)), RECOVERY_DEG) / self.repetition_s
        )

    @property
    def at_minimum(self) -> bool:
        """True if the range cannot be reduced further."""
        return self._wanted == self.least_share

    @property
    def is_full(self) -> bool:
        """True if the whole range of the loaded recording is played."""
        return self.share == 1.0

    def reduce(self) -> None:
        """Reduce the target range by one step."""
        wanted = self._wanted - REDUCTION_STEP
        # If only half a step would be left, remove it too.
        self._wanted = self.least_share if wanted < self.least_share + REDUCTION_STEP / 2 else wanted
        self._since_s = 0.0

    def apply(self, motion: PathPoint, speed_override: float, dt_s: float) -> PathPoint:
        """Advance by ``dt_s`` and return the path's motion with the present range.

        :param motion: motion of the path itself, in real time.
        :param speed_override: below 0 while the arm moves backwards.
        """
        passed_s = abs(speed_override) * dt_s
        forward_s = max(speed_override, 0.0) * dt_s
        self._since_s += forward_s
        back_s = min(forward_s, max(0.0, self._since_s - self.repetition_s))
        self._wanted = min(1.0, self._wanted + self._recovery_s * back_s)
        if self.is_full and self._wanted == 1.0:
            return motion
        from_rest_deg = motion.angles_deg - self.trajectory.rest_deg
        before_s = self._rate_s
        self._approach(passed_s, self._max_rate_s(motion, from_rest_deg))
        override_rate = (self._rate_s - before_s) / dt_s
        return PathPoint(
            self.reduced_deg(motion.angles_deg),
            self.share * motion.speed_deg_s + abs(speed_override) * self._rate_s * from_rest_deg,
            self.share * motion.acceleration_deg_s2
            + 2 * abs(speed_override) * self._rate_s * motion.speed_deg_s
            + abs(speed_override) * override_rate * from_rest_deg,
        )

    def reduced_deg(self, angles_deg: Floats) -> Floats:
        """Return angles of the recording, ``(5,)``, with the present range."""
        return self.trajectory.rest_deg + self.share * (angles_deg - self.trajectory.rest_deg)

    def _approach(self, passed_s: float, fastest_s: float) -> None:
        """Move the share towards its target. Limit the rate so that the share can still stop at the target."""
        if passed_s == 0.0:
            return
        second_difference = _MAX_ACCELERATION_PER_S2 * passed_s**2
        left = self._wanted - self.share
        most = min(fastest_s * passed_s, longest_step(abs(left), second_difference))
        before = self._rate_s * passed_s
        change = min(max(min(max(left, -most), most), before - second_difference), before + second_difference)
        self.share += change
        self._rate_s = change / passed_s

    def _max_rate_s(self, motion: PathPoint, from_rest_deg: Floats) -> float:
        """Return how fast the share may change (1/s) without a motor exceeding its speed limit."""
        room = np.clip(self.max_speed_deg_s - self.share * np.abs(motion.speed_deg_s), 0.0, _MAX_RATE_DEG_S)
        away = np.abs(from_rest_deg)
        fastest = np.divide(room, away, out=np.full_like(away, _MAX_RATE_PER_S), where=away > 0)
        return min(_MAX_RATE_PER_S, float(np.min(fastest)))
