"""Detects the drive that pushes against the patient, and calculates how a held setpoint yields to the push.

For numbers and reasons see docs/explanation/decisions/0020-resistance-is-monitored-in-every-phase.md.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from kata.device.cycle_state import CycleState
from kata.motion.linkage import Floats

RESISTANCE_AFTER_NS: Final = 100_000_000
"""A push must last this long to count as resistance. Shorter torque peaks come from friction and from the contact of gear flanks."""
SLOW_DEG_S: Final = 1.0
"""Below this speed the path's direction is not reliable. In recorded holds the smoothed reference moves with 0.2 deg/s (RMS)."""
_COUNT_DEG: Final = 0.1
"""An angle closer than this to its setpoint counts as equal. One count of a 4096-count encoder is 0.088 deg."""
PUSH_END_LIMIT_NS: Final = 1_000_000_000
"""While the arm moves back, the push that caused this is ignored for this time. At 100 Hz even the softest drive stops pushing within it, also if
the arm does not move."""
_TO_MEASURED_S: Final = 0.05
"""Time constant with which a yielding setpoint moves to the measured angle."""
_RETREAT_DEG_S_NM: Final = 6.0
"""Speed of a yielding setpoint for each Nm above the level, which unwinds the integral part of the drive's control."""
_RETREAT_DEG_NM: Final = 0.1
"""Limit of the retreat in one setpoint, for each Nm. A stiff drive answers 1 deg with 2.8 Nm, so a larger step at 10 Hz would oscillate."""
MAX_YIELD_DEG: Final = 15.0
"""Largest distance that a setpoint yields, so that a broken current sensor cannot move an arm far. The setpoint of motor 5, the
softest drive, is 9.5 deg ahead at its rated torque."""
_RESUME_DEG_S: Final = 5.0
"""Speed at which a yielded setpoint moves back to the path when the recording plays again."""


class ResistanceMonitor:
    """Finds the axis whose drive pushes with at least the patient's level for :data:`RESISTANCE_AFTER_NS`."""

    def __init__(self, thresholds_nm: Sequence[float]) -> None:
        """``thresholds_nm``: the level's torque of each axis."""
        self._thresholds_nm = thresholds_nm
        self._since_ns: list[int | None] = [None] * len(thresholds_nm)
        self._last_push: tuple[int, float, int] | None = None
        """Axis and direction of the push that caused the last reversal, and the time until which it may end."""

    def start_after_reversal(self, axis: int, torque_nm: float, t_ns: int) -> None:
        """Restart after a reversal. The push that caused it does not count again until :data:`PUSH_END_LIMIT_NS` has passed."""
        self._since_ns = [None] * len(self._thresholds_nm)
        self._last_push = (axis, np.sign(torque_nm), t_ns + PUSH_END_LIMIT_NS)

    def resisting_axis(self, state: CycleState, speed_deg_s: Sequence[float], *, moves_back: bool) -> int | None:
        """Return the first axis that meets resistance in this cycle, else None.

        :param speed_deg_s: speed of the reference: the path's own speed times the speed override.
        :param moves_back: True while the arm moves back from the last resistance, whose push then has time to end.
        """
        found = None
        for n, threshold_nm in enumerate(self._thresholds_nm):
            torque_nm = state.torque_nm[n]
            ahead_deg = state.setpoint_deg[n] - state.measured_deg[n]
            since_ns = self._since_ns[n]
            if (
                abs(torque_nm) < threshold_nm
                or not _pushes(torque_nm, speed_deg_s[n], ahead_deg)
                or (moves_back and self._is_subsiding(n, state))
            ):
                self._since_ns[n] = None
            elif since_ns is None:
                self._since_ns[n] = state.t_ns
            elif found is None and state.t_ns - since_ns >= RESISTANCE_AFTER_NS:
                found = n
        return found

    def _is_subsiding(self, n: int, state: CycleState) -> bool:
        """Return True while the push that caused the last reversal still has time to end."""
        if self._last_push is None:
            return False
        axis, sign, until_ns = self._last_push
        return n == axis and bool(np.sign(state.torque_nm[n]) == sign) and state.t_ns < until_ns


def _pushes(torque_nm: float, speed_deg_s: float, ahead_deg: float) -> bool:
    """Return True if a torque acts in the direction in which the drive pushes the arm.

    A moving axis pushes if its torque acts along its path. An axis at rest, or slower than :data:`SLOW_DEG_S`, also pushes
    if its torque acts towards its setpoint. If the arm is at the setpoint, a torque of the drive's integral part counts as a
    push in its own direction.
    """
    if torque_nm * speed_deg_s > 0:
        return True
    return abs(speed_deg_s) < SLOW_DEG_S and np.sign(torque_nm) * ahead_deg > -_COUNT_DEG


class YieldOffset:
    """The offset ``(5,)`` in degrees by which each setpoint leaves its path to yield to the patient's push."""

    def __init__(self, thresholds_nm: Sequence[float], rate_hz: int, resume_deg_s: float) -> None:
        """Start without offset. ``resume_deg_s``: highest speed at which the setpoint may move back to the path."""
        self._thresholds_nm = np.array(thresholds_nm)
        self._share = min(1.0, 1.0 / rate_hz / _TO_MEASURED_S)
        self._retreat_deg_nm = min(_RETREAT_DEG_NM, _RETREAT_DEG_S_NM / rate_hz)
        self._resume_deg = min(_RESUME_DEG_S, resume_deg_s) / rate_hz
        self.offset_deg: Floats = np.zeros(len(thresholds_nm))

    def yield_to(self, torque_nm: Floats, setpoint_deg: Floats, measured_deg: Floats) -> None:
        """Move the offset against each torque above the level: quickly to the measured angle, and slowly beyond it.

        All parameters are ``(5,)``. A torque below the level changes nothing.
        """
        sign = np.sign(torque_nm)
        excess_nm = np.abs(torque_nm) - self._thresholds_nm
        ahead_deg = np.maximum((setpoint_deg - measured_deg) * sign, 0.0)
        change = self._share * ahead_deg + self._retreat_deg_nm * excess_nm
        self.retreat(np.where(excess_nm >= 0.0, -sign * change, 0.0))

    def retreat(self, change_deg: Floats) -> None:
        """Change the offset for one setpoint, ``(5,)``."""
        self.offset_deg = np.clip(self.offset_deg + change_deg, -MAX_YIELD_DEG, MAX_YIELD_DEG)

    def resume(self, speed_override: float) -> None:
        """Reduce the offset for one setpoint period in which the recording plays at ``speed_override``."""
        back = self._resume_deg * speed_override
        self.offset_deg = self.offset_deg - np.clip(self.offset_deg, -back, back)

    def keep_within(self, lowest_deg: Floats, highest_deg: Floats) -> None:
        """Limit the offset (all ``(5,)``), so that it does not grow while a limit holds the setpoint."""
        self.offset_deg = np.minimum(
            np.maximum(self.offset_deg, np.minimum(lowest_deg, 0.0)), np.maximum(highest_deg, 0.0)
        )
