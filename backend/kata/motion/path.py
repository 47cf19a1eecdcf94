"""Defines a path and a point of it. It does not import scipy, so that the simulated apparatus starts in a third of the time."""

from typing import NamedTuple, Protocol

from kata.motion.linkage import Floats


class PathPoint(NamedTuple):
    """Angles, speed and acceleration of a path at one time: ``(5,)`` each, in deg, deg/s and deg/s2."""

    angles_deg: Floats
    speed_deg_s: Floats
    acceleration_deg_s2: Floats


class Path(Protocol):
    """Angles ``(5,)`` in degrees for any time from 0 to the duration, and their derivatives."""

    @property
    def duration_s(self) -> float:
        """Duration of the path."""

    def motion_at(self, time_s: float) -> PathPoint:
        """Return angles, speed and acceleration at a time on the path's own clock."""
