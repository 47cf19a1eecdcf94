"""Implements the setpoint gate, the last check of a setpoint before it is sent to the drives."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from kata.device.config import Axis, StationConfig
from kata.device.cycle_state import CycleState, Limits
from kata.device.faults import FaultKey

if TYPE_CHECKING:
    from kata.device.state_machine import StateMachine

_MAX_STEP_SHARE: Final = 1.5
_STEP_TOLERANCE_DEG: Final = 1.0
_ROUNDING_DEG: Final = 1e-6


def largest_step_deg(axis: Axis, rate_hz: int) -> float:
    """Return the largest allowed change from one setpoint to the next at ``rate_hz`` setpoints a second, in degrees."""
    return _MAX_STEP_SHARE * axis.max_speed_deg_s / rate_hz + _STEP_TOLERANCE_DEG


def refused_setpoints(
    last_deg: Sequence[Sequence[float]],
    next_deg: Sequence[float],
    limits_deg: Limits,
    config: StationConfig,
    rate_hz: int,
) -> list[FaultKey]:
    """Check a setpoint before it is sent. Return the faults: beyond a limit, too far from the last setpoint, or too much
    acceleration. Empty if there is none.

    :param last_deg: the last one or two setpoints, the newest last.
    :param rate_hz: number of setpoints a second.

    NaN violates every limit.
    """
    newest = last_deg[-1]
    found: list[FaultKey] = []
    for n, (axis, angle, (low, high)) in enumerate(zip(config.axes, next_deg, limits_deg, strict=True)):
        if not low - _ROUNDING_DEG <= angle <= high + _ROUNDING_DEG:
            found.append(("setpoint_limit", n))
        if not abs(angle - newest[n]) <= largest_step_deg(axis, rate_hz):
            found.append(("setpoint_step", n))
        elif len(last_deg) > 1:
            second_difference = abs(angle - 2 * newest[n] + last_deg[-2][n]) * rate_hz**2
            if second_difference > axis.max_acceleration_deg_s2:
                found.append(("setpoint_acceleration", n))
    return found


class SetpointGate:
    """Checks every setpoint before it is sent, regardless of the mode that computed it."""

    def __init__(self) -> None:
        """Prepare without a setpoint."""
        self._sent_deg: list[tuple[float, ...]] = []
        """The last one or two checked setpoints since torque was switched on."""

    def check(self, machine: "StateMachine", state: CycleState) -> None:
        """Check the setpoint of this cycle. A refused one stops the arm."""
        if not machine.torque_on:
            self._sent_deg.clear()
        elif machine.setpoint_due or not self._sent_deg:
            before = self._sent_deg or [state.measured_deg]
            refused = (
                refused_setpoints(before, machine.setpoint_deg, machine.limits_deg, machine.config, machine.rate_hz)
                or machine.refused_pose()
            )
            if refused:
                machine.abort(state, refused)
            self._sent_deg = [*before[-1:], machine.setpoint_deg]
