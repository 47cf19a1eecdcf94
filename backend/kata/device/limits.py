"""Limits of one run for setpoints and measured angles; wider for an arm that starts outside them."""

from collections.abc import Sequence
from typing import Final

from kata.device.cycle_state import Limits
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import POSE_ROUNDING_DEG

SETTLE_S: Final = 1.0
"""Time for the arm to come within the patient's limits after the approach's path has ended. After that the limits count
in any case, and an arm outside them is a fault.
"""
_INSIDE_SHARE: Final = 0.25
"""Share of the limit tolerance within which an arm counts as inside. It is half of the distance that is a fault, so
that a drive's lag and noise are not a fault when the limits tighten.
"""


class RunLimits:
    """The tighter of mechanism and patient, for each motor and for the pose of the arm. During the approach they extend
    to the arm and then only move inwards.
    """

    def __init__(self, mechanism_deg: Limits, patients_deg: Limits, tolerance_deg: float, gate: PoseGate) -> None:
        """``patients_deg``: empty for none. ``tolerance_deg``: how far beyond the mechanism's range a measured angle
        may be.
        """
        self._gate = gate
        self.beyond_deg = 0.0
        """How far a setpoint may be beyond the limits of the pose: above 0 only while the limits are widened."""
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
        self.beyond_deg = max(0.0, self._gate.beyond_deg(here_deg))

    def tighten(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float]) -> None:
        """Move widened limits inwards, to the setpoint or the measured angle, whichever is further out. They never
        widen again.
        """
        places = zip(self.now_deg, self.tight_deg, setpoint_deg, measured_deg, strict=True)
        self.now_deg = tuple(
            (max(low, min(tight_low, setpoint, angle)), min(high, max(tight_high, setpoint, angle)))
            for (low, high), (tight_low, tight_high), setpoint, angle in places
        )
        if self.beyond_deg > 0.0:
            further_deg = max(self._gate.beyond_deg(setpoint_deg), self._gate.beyond_deg(measured_deg))
            self.beyond_deg = max(0.0, min(self.beyond_deg, further_deg))

    def settle(self, setpoint_deg: Sequence[float], measured_deg: Sequence[float], dt_s: float) -> bool:
        """Let ``dt_s`` pass at the end of the approach. Return True once the tight limits count.

        They count when the setpoint is inside them, and the arm is inside or has had :data:`SETTLE_S`.
        """
        self._settling_s += dt_s
        settled = self._settling_s >= SETTLE_S or self._inside(measured_deg, self._near_deg)
        if not (settled and self._inside(setpoint_deg, 0.0)):
            return False
        self.now_deg, self.beyond_deg = self.tight_deg, 0.0
        return True

    def _inside(self, angles_deg: Sequence[float], tolerance_deg: float) -> bool:
        places = zip(angles_deg, self.tight_deg, strict=True)
        within = all(low - tolerance_deg <= angle <= high + tolerance_deg for angle, (low, high) in places)
        return within and self._gate.beyond_deg(angles_deg) <= tolerance_deg + POSE_ROUNDING_DEG
