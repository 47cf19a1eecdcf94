"""Movement along a path with a speed override that changes smoothly."""

import math
from dataclasses import dataclass
from typing import Final, Literal

from kata.motion.path import Path, PathPoint

RAMP_S: Final = 0.2
"""Time from rest to the path's own speed, and from that speed to rest. It applies to start, pause and category 1 stop."""
CREEP: Final = 0.1
"""The speed override at which a path's end is reached. It is above 0 so that the movement does not stop just before the end."""


def longest_step(left: float, second_difference: float) -> float:
    """Return the longest step towards the goal from which the movement can still stop at the goal, if each step may be
    shorter than the one before by at most ``second_difference``.

    ``left``: remaining distance. Both parameters have the same unit. :func:`~kata.device.setpoint_limiters.longest_steps` takes arrays.
    """
    # From a step between m and m + 1 second differences the movement stops after m more steps.
    more = math.floor((math.sqrt(1 + 8 * left / second_difference) - 1) / 2)
    return (left + second_difference * more * (more + 1) / 2) / (more + 1)


@dataclass
class Movement:
    """A place on a path and the speed override: 0 is rest, 1 is the path's own speed, -1 is the same speed backwards."""

    path: Path
    position_s: float = 0.0
    speed_override: float = 0.0
    direction: Literal[-1, 0, 1] = 1
    """Target direction: 1 forwards, -1 backwards, 0 slow down to rest."""
    reverse_to_s: float = 0.0
    """Place on the path at which a backward movement ends."""
    top_override: float = 1.0
    """Highest speed override."""
    ramp_s: float = RAMP_S
    """Time from rest to full speed, and from full speed to rest."""
    shortest_ramp_s: float = RAMP_S
    """Shortest ramp that the axes' acceleration limits allow. It replaces a shorter :attr:`ramp_s`."""
    creep: float = CREEP
    """The speed override at which the path's end is reached."""
    override_rate: float = 0.0
    """Present change of the speed override, in 1/s."""

    def advance(self, dt_s: float) -> None:
        """Advance by ``dt_s``. Slow down before the path's end, because a recording may end in full motion."""
        change = dt_s / max(self.ramp_s, self.shortest_ramp_s)
        wanted = 0.0
        if self.direction:
            in_time = longest_step(self._left_s, change * dt_s) / dt_s
            wanted = self.direction * min(self.top_override, max(in_time, self.creep))
        changed = min(max(wanted - self.speed_override, -change), change)
        self.speed_override += changed
        self.override_rate = changed / dt_s
        self.position_s = min(max(self.position_s + self.speed_override * dt_s, self._lowest_s), self.path.duration_s)

    def place_s(self, lead_s: float) -> float:
        """Return the place on the path ``lead_s`` from now."""
        return self.position_s + self.speed_override * lead_s

    def motion(self, lead_s: float) -> PathPoint:
        """Return angles, speed and acceleration that the arm should have ``lead_s`` from now, in real time."""
        angles, speed, acceleration = self.path.motion_at(self.place_s(lead_s))
        return PathPoint(
            angles, self.speed_override * speed, self.speed_override**2 * acceleration + self.override_rate * speed
        )

    @property
    def ended(self) -> bool:
        """True if the end of the path in the present direction is reached."""
        return self.direction != 0 and self._left_s <= 0.0

    @property
    def at_rest(self) -> bool:
        """True if the movement has slowed down to rest."""
        return self.direction == 0 and self.speed_override == 0.0

    @property
    def _left_s(self) -> float:
        return self.position_s - self._lowest_s if self.direction == -1 else self.path.duration_s - self.position_s

    @property
    def _lowest_s(self) -> float:
        return min(self.reverse_to_s, self.position_s) if self.direction == -1 else 0.0
