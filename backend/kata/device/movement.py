"""Going along a path at a pace that never changes abruptly."""

from dataclasses import dataclass
from typing import Final, Literal, Protocol

import numpy as np

from kata.motion.linkage import Floats
from kata.motion.path import Motion

RAMP_S: Final = 0.2
"""From standing to the path's own pace, and back: starting, pausing, turning round, and a category 1 stop."""
CREEP: Final = 0.1
"""The pace at which an end is met: slowing down must not come to a stand just before it."""


def longest_step(left: Floats | float, second_difference: Floats | float) -> Floats:
    """The longest step towards what is left that can still be slowed down from, each step shorter than the last by ``second_difference`` at most.

    Both in the same unit, of any shape.
    """
    step: Floats = np.sqrt(second_difference * (second_difference / 4 + 2 * left)) - second_difference / 2
    return step


class Path(Protocol):
    """Angles ``(5,)`` in degrees for any time from 0 to its duration, and how they change."""

    @property
    def duration_s(self) -> float:
        """Time at its end."""

    def motion_at(self, time_s: float) -> Motion:
        """Angles, speed and acceleration at a time, along the path's own clock."""


@dataclass
class Movement:
    """A place on a path and the pace along it: 0 stands, 1 is the path's own speed, -1 goes back as fast."""

    path: Path
    position_s: float = 0.0
    speed_override: float = 0.0
    direction: Literal[-1, 0, 1] = 1
    """Where it is to go: on, back, or to a stand."""
    reverse_to_s: float = 0.0
    """Where going back ends."""
    ramp_s: float = RAMP_S
    """From standing to full pace, and back."""
    shortest_ramp_s: float = 0.0
    """What the axes' acceleration leaves of :attr:`ramp_s`: changes of pace take no less."""
    creep: float = CREEP
    """The pace at which the path's end is met."""
    override_rate: float = 0.0
    """How the pace changes at present, a second."""

    def advance(self, dt_s: float) -> None:
        """Let ``dt_s`` pass. Slows down in time for the path's end: a recording may break off in full motion."""
        change = dt_s / max(self.ramp_s, self.shortest_ramp_s)
        wanted = 0.0
        if self.direction:
            in_time = float(longest_step(self._left_s, change * dt_s)) / dt_s
            wanted = self.direction * min(1.0, max(in_time, self.creep))
        changed = min(max(wanted - self.speed_override, -change), change)
        self.speed_override += changed
        self.override_rate = changed / dt_s
        self.position_s = min(max(self.position_s + self.speed_override * dt_s, self._lowest_s), self.path.duration_s)

    def place_s(self, lead_s: float) -> float:
        """Where on the path it will be ``lead_s`` from now."""
        return self.position_s + self.speed_override * lead_s

    def motion(self, lead_s: float) -> Motion:
        """Where the arm should be ``lead_s`` from now, and how it should move there by everybody's clock."""
        angles, speed, acceleration = self.path.motion_at(self.place_s(lead_s))
        return Motion(
            angles, self.speed_override * speed, self.speed_override**2 * acceleration + self.override_rate * speed
        )

    @property
    def ended(self) -> bool:
        """The end of its course is reached."""
        return self.direction != 0 and self._left_s <= 0.0

    @property
    def at_rest(self) -> bool:
        """It has slowed down to a stand."""
        return self.direction == 0 and self.speed_override == 0.0

    @property
    def _left_s(self) -> float:
        return self.position_s - self._lowest_s if self.direction == -1 else self.path.duration_s - self.position_s

    @property
    def _lowest_s(self) -> float:
        return min(self.reverse_to_s, self.position_s) if self.direction == -1 else 0.0
