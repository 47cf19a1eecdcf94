"""Calculates the approach: minimum-jerk movements from the arm's position to the start of a motion, without a jump.

With the paper's method, playback starts at the arm's position, so the arm jumps to the first angle; the paper excludes the
start from its errors (Section 4). The approach replaces that jump.

The arm always reaches a start from the same side. The direction of the last movement determines which flank of a gear the
motor touches and in which direction friction acts. Without a fixed direction, these two would change the start from run to
run. Machine tools use unidirectional positioning for the same reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kata.motion.linkage import Floats
from kata.motion.path import PathPoint

_PEAK_OVER_MEAN = 1.875
"""Peak speed of a minimum-jerk movement divided by its mean speed (10 t^3 - 15 t^4 + 6 t^5 at t = 1/2)."""
_SHORTEST_S = 0.5
_RUN_UP_S = 1.0
"""Duration of the last part of the approach, chosen so that it ends within one encoder count of the start. In half of this
time motor 5 stops up to three counts short.
"""


@dataclass(frozen=True)
class MinimumJerkMove:
    """A minimum-jerk movement between two postures. All axes arrive at the same time.

    ``start_deg`` and ``goal_deg`` are ``(5,)``; no axis exceeds ``speed_deg_s``.
    """

    start_deg: Floats
    goal_deg: Floats
    speed_deg_s: float
    at_least_s: float = _SHORTEST_S
    """Lower limit of the duration, so that a short movement is also gentle."""

    @cached_property
    def duration_s(self) -> float:
        """Duration from start to goal."""
        farthest = float(np.max(np.abs(self.goal_deg - self.start_deg)))
        return max(self.at_least_s, _PEAK_OVER_MEAN * farthest / self.speed_deg_s)

    def at(self, time_s: float) -> Floats:
        """Return the angles ``(5,)`` in degrees at ``time_s``; before the start and after the end they are constant."""
        return self.motion_at(time_s).angles_deg

    def motion_at(self, time_s: float) -> PathPoint:
        """Return angles, speed and acceleration at ``time_s``. Before the start and after the end the arm is at rest."""
        t = min(max(time_s / self.duration_s, 0.0), 1.0)
        distance = self.goal_deg - self.start_deg
        return PathPoint(
            self.start_deg + distance * (t**3 * (10 - 15 * t + 6 * t * t)),
            distance * (30 * t * t * (1 - t) ** 2 / self.duration_s),
            distance * (60 * t * (1 - t) * (1 - 2 * t) / self.duration_s**2),
        )


@dataclass(frozen=True)
class PathSequence:
    """A sequence of movements. Each begins where the one before ends, and the arm comes to rest between them."""

    movements: Sequence[MinimumJerkMove]

    @property
    def duration_s(self) -> float:
        """Total duration of all movements."""
        return sum(movement.duration_s for movement in self.movements)

    def motion_at(self, time_s: float) -> PathPoint:
        """Return angles, speed and acceleration at ``time_s``. Before the start and after the end the arm is at rest."""
        *earlier, last = self.movements
        for movement in earlier:
            if time_s < movement.duration_s:
                return movement.motion_at(time_s)
            time_s -= movement.duration_s
        return last.motion_at(time_s)


def unidirectional_approach(
    here_deg: Floats, start_deg: Floats, departure_deg: Floats, speed_deg_s: float
) -> PathSequence:
    """Return the approach from the arm's position to a recording's start. Every axis arrives from the side to which it will
    leave the start. All angles are ``(5,)``.

    The recording itself covers that side, so the limits allow it. On the other side of the start a limit may be close.

    :param departure_deg: how each axis leaves the start; see :class:`~kata.motion.trajectory.Trajectory`.
    """
    aside = start_deg + departure_deg
    return PathSequence(
        [MinimumJerkMove(here_deg, aside, speed_deg_s), MinimumJerkMove(aside, start_deg, speed_deg_s, _RUN_UP_S)]
    )
