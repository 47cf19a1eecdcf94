"""Going along a path at a pace that never changes abruptly."""

from dataclasses import dataclass
from typing import Protocol

from kata.motion.linkage import Floats

RAMP_S = 0.25
"""From standing to the path's own pace, and back: starting, pausing, and a category 1 stop."""


class Path(Protocol):
    """Angles ``(5,)`` in degrees for any time from 0 to its duration."""

    @property
    def duration_s(self) -> float:
        """Time at its end."""

    def at(self, time_s: float) -> Floats:
        """Angles at a time."""


@dataclass
class Movement:
    """A place on a path and the pace along it: 0 stands, 1 is the path's own speed."""

    path: Path
    position_s: float = 0.0
    pace: float = 0.0
    going: bool = True

    def advance(self, dt_s: float) -> None:
        """Let ``dt_s`` pass."""
        change = dt_s / RAMP_S
        self.pace = min(1.0, self.pace + change) if self.going else max(0.0, self.pace - change)
        self.position_s = min(self.position_s + self.pace * dt_s, self.path.duration_s)

    def setpoint(self, lead_s: float) -> Floats:
        """Where the arm should be ``lead_s`` from now."""
        return self.path.at(self.position_s + self.pace * lead_s)

    @property
    def ended(self) -> bool:
        """The path's end is reached."""
        return self.position_s >= self.path.duration_s

    @property
    def stands(self) -> bool:
        """It has slowed down to a stand."""
        return self.pace == 0.0 and not self.going
