"""Going along a path at a pace that never changes abruptly."""

from dataclasses import dataclass
from typing import Final, Literal, Protocol

from kata.motion.linkage import Floats

RAMP_S: Final = 0.2
"""From standing to the path's own pace, and back: starting, pausing, turning round, and a category 1 stop."""
_CREEP: Final = 0.1
"""The pace at which an end is met: slowing down must not come to a stand just before it."""


class Path(Protocol):
    """Angles ``(5,)`` in degrees for any time from 0 to its duration."""

    @property
    def duration_s(self) -> float:
        """Time at its end."""

    def at(self, time_s: float) -> Floats:
        """Angles at a time."""


@dataclass
class Movement:
    """A place on a path and the pace along it: 0 stands, 1 is the path's own speed, -1 goes back as fast."""

    path: Path
    position_s: float = 0.0
    pace: float = 0.0
    course: Literal[-1, 0, 1] = 1
    """Where it is to go: on, back, or to a stand."""
    back_to_s: float = 0.0
    """Where going back ends."""
    ramp_s: float = RAMP_S
    """From standing to full pace, and back."""

    def advance(self, dt_s: float) -> None:
        """Let ``dt_s`` pass. Slows down in time for the path's end: a recording may break off in full motion."""
        wanted = float(self.course)
        if self.course and self._left_s <= self.pace**2 * self.ramp_s / 2 + abs(self.pace) * dt_s:
            wanted *= _CREEP
        change = dt_s / self.ramp_s
        self.pace += min(max(wanted - self.pace, -change), change)
        self.position_s = min(max(self.position_s + self.pace * dt_s, self._lowest_s), self.path.duration_s)

    def setpoint(self, lead_s: float) -> Floats:
        """Where the arm should be ``lead_s`` from now."""
        return self.path.at(self.position_s + self.pace * lead_s)

    @property
    def ended(self) -> bool:
        """The end of its course is reached."""
        return self.course != 0 and self._left_s <= 0.0

    @property
    def stands(self) -> bool:
        """It has slowed down to a stand."""
        return self.course == 0 and self.pace == 0.0

    @property
    def _left_s(self) -> float:
        return self.position_s - self._lowest_s if self.course == -1 else self.path.duration_s - self.position_s

    @property
    def _lowest_s(self) -> float:
        return min(self.back_to_s, self.position_s) if self.course == -1 else 0.0
