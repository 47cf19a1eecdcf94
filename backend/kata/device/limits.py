"""Limits of one run for setpoints and measured angles; wider for an arm that starts outside them."""

from collections.abc import Sequence
from typing import Final

from kata.device.cycle_state import Limits

SETTLE_S: Final = 1.0
"""Time for the arm to come within the patient's limits after the approach's path has ended. After that the limits count
in any case, and an arm outside them is a fault.
"""
_INSIDE_SHARE: Final = 0.25
"""Share of the limit tolerance within which an arm counts as inside. It is half of the distance that is a fault, so
that a drive's lag and noise are not a fault when the limits tighten.
"""


class RunLimits:
    """The tighter of mechanism and patient. During the approach they extend to the arm and then only move inwards."""

    def __init__(self, mechanism_deg: Limits, patients_deg: Limits, tolerance_deg: float) -> None:
        """``patients_deg``: empty for none. ``tolerance_deg``: how far beyond the mechanism's range a measured angle
        may be.
        """
        self.tight_deg = mechanism_deg
        if patients_deg:
            self.tight_deg = tuple(
                (max(low, patients_low), min(high, patients_high))
                for (low, high), (patients_low, patients_high) in zip(mechanism_deg, patients_deg, strict=True)
            )
        self.now_deg = self.tight_deg
        self._near_deg = _INSIDE_SHARE * tolerance_deg
        self._settling_s = 0.0

    @property
    def widened(self) -> bool:
        """True during the approach."""
        return self.now_deg is not self.tight_deg

    def widen(self, here_deg: Sequence[float]) -> None:
        """Extend the limits to the arm's present angles."""
        self.now_deg = tuple(
            (min(low, angle), max(high, angle)) for (low, high), angle in zip(self.tight_deg, here_deg, strict=True)
        )

    def tighten(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float]) -> None:
        """Move widened limits inwards, to the setpoint or the measured angle, whichever is further out. They never
        widen again.
        """
        places = zip(self.now_deg, self.tight_deg, setpoint_deg, measured_deg, strict=True)
        self.now_deg = tuple(
            (max(low, min(tight_low, setpoint, angle)), min(high, max(tight_high, setpoint, angle)))
            for (low, high), (tight_low, tight_high), setpoint, angle in places
        )

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Let ``dt_s`` pass at the end of the approach. Return True once the tight limits count.

        They count when the setpoint is inside them, and the arm is inside or has had :data:`SETTLE_S`.
        """
        self._settling_s += dt_s
        settled = self._settling_s >= SETTLE_S or self._inside(measured_deg, self._near_deg)
        if not (settled and self._inside(setpoint_deg, 0.0)):
            return False
        self.now_deg = self.tight_deg
        return True

    def _inside(self, angles_deg: Sequence[float], tolerance_deg: float) -> bool:
        places = zip(angles_deg, self.tight_deg, strict=True)
        return all(low - tolerance_deg <= angle <= high + tolerance_deg for angle, (low, high) in places)
