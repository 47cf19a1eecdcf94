"""Defines a point of a path. It does not import scipy, so that the simulated apparatus starts in a third of the time."""

from typing import NamedTuple

from kata.motion.linkage import Floats


class PathPoint(NamedTuple):
    """Angles, speed and acceleration of a path at one time: ``(5,)`` each, in deg, deg/s and deg/s2."""

    angles_deg: Floats
    speed_deg_s: Floats
    acceleration_deg_s2: Floats
