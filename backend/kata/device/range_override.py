"""Less range, asked for while a recording plays, and its slow way back: a comfort zone."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.device.movement import longest_step
from kata.motion.linkage import Floats
from kata.motion.path import Motion
from kata.motion.trajectory import Trajectory

REDUCTION_STEP: Final = 0.1
"""Of the range, each time that somebody asks for less."""
MIN_SHARE: Final = 0.2
RECOVERY_DEG: Final = 2.5
"""Of the motor that goes farthest, in each repetition: as much as a warm-up widens by."""
_MAX_RATE_S: Final = 0.25
"""Of the range in a second: a step takes under a second, 60 deg from the middle it is 15 deg/s."""
_MAX_ACCELERATION_S2: Final = 1.0
"""Of the range in a second, each second: 60 deg from the middle it is 60 deg/s^2."""


@dataclass
class RangeOverride:
    """How much of a recording's range is played, around the middle of what each motor goes through.

    It changes with the pace of the path: where the arm is held, it stays held. Back it goes after a whole repetition without
    another wish for less, and only on the way forward.
    """

    trajectory: Trajectory
    repetition_s: float
    """Of the path: after so much of it the same comes again."""
    max_speed_deg_s: Floats
    """``(5,)``: what a motor does at its limit is not made faster by this."""
    share: float = 1.0
    """1 is what was asked for at load."""

    def __post_init__(self) -> None:
        self._wanted = self.share
        self._rate_s = 0.0
        self._since_s = math.inf
        """Of the path, since somebody asked for less."""
        self._recovery_s = (
            RECOVERY_DEG / max(float(np.max(self.trajectory.reach_deg)), RECOVERY_DEG) / self.repetition_s
        )

    @property
    def at_minimum(self) -> bool:
        """There is no less."""
        return self._wanted == MIN_SHARE

    @property
    def is_full(self) -> bool:
        """The range is the one that was asked for at load."""
        return self.share == 1.0

    def reduce(self) -> None:
        """A step less than what is wanted now."""
        wanted = self._wanted - REDUCTION_STEP
        # What would be left for half a step is taken with this one.
        self._wanted = MIN_SHARE if wanted < MIN_SHARE + REDUCTION_STEP / 2 else wanted
        self._since_s = 0.0

    def apply(self, motion: Motion, speed_override: float, dt_s: float) -> Motion:
        """Let ``dt_s`` pass at a pace, and give the path's motion with what is left of its range.

        :param motion: of the path itself, by everybody's clock.
        :param pace: below 0 while the arm is taken back.
        """
        passed_s = abs(speed_override) * dt_s
        forward_s = max(speed_override, 0.0) * dt_s
        self._since_s += forward_s
        back_s = min(forward_s, max(0.0, self._since_s - self.repetition_s))
        self._wanted = min(1.0, self._wanted + self._recovery_s * back_s)
        if self.is_full and self._wanted == 1.0:
            return motion
        from_middle_deg = motion.angles_deg - self.trajectory.middle_deg
        before_s = self._rate_s
        self._approach(passed_s, self._max_rate_s(motion, from_middle_deg))
        override_rate = (self._rate_s - before_s) / dt_s
        return Motion(
            self.trajectory.middle_deg + self.share * from_middle_deg,
            self.share * motion.speed_deg_s + abs(speed_override) * self._rate_s * from_middle_deg,
            self.share * motion.acceleration_deg_s2
            + 2 * abs(speed_override) * self._rate_s * motion.speed_deg_s
            + abs(speed_override) * override_rate * from_middle_deg,
        )

    def _approach(self, passed_s: float, fastest_s: float) -> None:
        """Towards what is wanted, no faster than it can still be slowed down from."""
        if passed_s == 0.0:
            return
        second_difference = _MAX_ACCELERATION_S2 * passed_s**2
        left = self._wanted - self.share
        most = min(fastest_s * passed_s, float(longest_step(abs(left), second_difference)))
        before = self._rate_s * passed_s
        change = min(max(min(max(left, -most), most), before - second_difference), before + second_difference)
        self.share += change
        self._rate_s = change / passed_s

    def _max_rate_s(self, motion: Motion, from_middle_deg: Floats) -> float:
        """How fast the range may change without making any motor faster than its limit."""
        room = np.maximum(self.max_speed_deg_s - self.share * np.abs(motion.speed_deg_s), 0.0)
        away = np.abs(from_middle_deg)
        fastest = np.divide(room, away, out=np.full_like(away, _MAX_RATE_S), where=away > 0)
        return min(_MAX_RATE_S, float(np.min(fastest)))
