"""Getting from where the arm is to where a motion begins, without a jump: one minimum-jerk movement.

The paper starts playback wherever the arm is, and excepts the start from its errors (Section 4); this is what
replaces the jump.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kata.motion.linkage import Floats
from kata.motion.path import Motion

_PEAK_OVER_MEAN = 1.875
"""Peak speed of a minimum-jerk movement over its mean speed (10 t^3 - 15 t^4 + 6 t^5 at t = 1/2)."""
_SHORTEST_S = 0.5


@dataclass(frozen=True)
class Approach:
    """A minimum-jerk movement between two postures, all axes arriving together.

    ``start_deg`` and ``goal_deg`` are ``(5,)``; no axis exceeds ``speed_deg_s``.
    """

    start_deg: Floats
    goal_deg: Floats
    speed_deg_s: float

    @cached_property
    def duration_s(self) -> float:
        """Time from start to goal; never below half a second, so that even a short way is gentle."""
        farthest = float(np.max(np.abs(self.goal_deg - self.start_deg)))
        return max(_SHORTEST_S, _PEAK_OVER_MEAN * farthest / self.speed_deg_s)

    def at(self, time_s: float) -> Floats:
        """Angles ``(5,)`` in degrees at ``time_s``; before the start and after the end it stands still."""
        return self.motion_at(time_s).angles_deg

    def motion_at(self, time_s: float) -> Motion:
        """Angles and how they change; before the start and after the end it stands still."""
        t = min(max(time_s / self.duration_s, 0.0), 1.0)
        way = self.goal_deg - self.start_deg
        return Motion(
            self.start_deg + way * (t**3 * (10 - 15 * t + 6 * t * t)),
            way * (30 * t * t * (1 - t) ** 2 / self.duration_s),
            way * (60 * t * (1 - t) * (1 - 2 * t) / self.duration_s**2),
        )
