"""The built-in motions: the paper's six basic motions and an arbitrary one (Section 4).

Each motion starts and ends with the arm hanging at rest. The motions use most of the range, and none is faster than
:data:`SPEED_DEG_S`.
"""

from itertools import pairwise
from typing import Final

import numpy as np

from kata.motion import texts
from kata.motion.approach import MinimumJerkMove
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.taught import Taught

SPEED_DEG_S: Final = 40.0
_STEP_S: Final = 0.01
_REST: Final = (0.0, 0.0, 10.0, 0.0, 0.0)
_WAYPOINTS: Final[tuple[tuple[tuple[float, ...], ...], ...]] = (
    ((16, 0, 10, 0, 0), (-16, 0, 10, 0, 0)),
    ((0, 16, 10, 0, 0), (0, -16, 10, 0, 0)),
    ((0, 0, 90, 0, 0), (0, 0, 90, 100, 0), (0, 0, 90, -15, 0), (0, 0, 90, 0, 0)),
    ((0, 0, 100, 0, 0), (0, 0, 5, 0, 0)),
    ((0, 0, 10, 150, 0), (0, 0, 10, -15, 0)),
    ((0, 0, 10, 90, 0), (0, 0, 10, 90, 30), (0, 0, 10, 90, -70), (0, 0, 10, 90, 0)),
)
_ARBITRARY: Final = (
    (6.0, 8.0, 40.0, 60.0, -10.0),
    (-8.0, 12.0, 80.0, 90.0, -50.0),
    (10.0, -6.0, 50.0, 120.0, 20.0),
    (0.0, 4.0, 20.0, 30.0, -20.0),
)


def built_in_motions() -> tuple[Taught, ...]:
    """Return the seven motions, in the paper's order."""
    named = [
        (texts.BUILTIN_MOTION(number=motion.number, motion=motion.name), points)
        for motion, points in zip(BASIC_MOTIONS, _WAYPOINTS, strict=True)
    ]
    return tuple(
        _through(name, points)
        for name, points in [*named, (texts.BUILTIN_MOTION(number=7, motion=texts.MOTION_7()), _ARBITRARY)]
    )


def _through(name: str, points: tuple[tuple[float, ...], ...]) -> Taught:
    """Return a minimum-jerk motion from rest through the waypoints and back to rest, sampled at 100 Hz."""
    stops = np.array([_REST, *points, _REST], dtype=np.float64)
    poses = [stops[0]]
    for start, goal in pairwise(stops):
        leg = MinimumJerkMove(start, goal, SPEED_DEG_S)
        steps = int(np.ceil(leg.duration_s / _STEP_S))
        poses += [leg.at(leg.duration_s * n / steps) for n in range(1, steps + 1)]
    return Taught(name, np.arange(len(poses), dtype=np.float64) * _STEP_S, np.array(poses))
