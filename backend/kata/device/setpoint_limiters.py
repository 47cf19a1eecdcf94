"""Limits how feed-forward and setpoint change: both can always stop in time within the axes' acceleration limits."""

from typing import Final

import numpy as np

from kata.device.cycle_state import Limits
from kata.motion.linkage import Floats

_ROUNDING_DEG: Final = 1e-9


def longest_steps(left: Floats, second_difference: Floats) -> Floats:
    """Return :func:`~kata.device.movement.longest_step` of each element."""
    more = np.floor((np.sqrt(1 + 8 * left / second_difference) - 1) / 2)
    steps: Floats = (left + second_difference * more * (more + 1) / 2) / (more + 1)
    return steps


class LimitedFeedForward:
    """The feed-forward of a run. It moves with its target without jumps."""

    def __init__(self, largest_step_deg: Floats, closing_step_deg: Floats) -> None:
        """``largest_step_deg``: largest change from one setpoint to the next, ``(5,)``. ``closing_step_deg``: largest step by which the
        feed-forward catches up with its target. From such a step it can stop within one setpoint.
        """
        self._largest_step_deg = largest_step_deg
        self._closing_step_deg = np.minimum(closing_step_deg, largest_step_deg)
        self.start()

    def start(self) -> None:
        """Start at 0, at rest."""
        self.deg: Floats = np.zeros_like(self._largest_step_deg)
        """The present feed-forward, ``(5,)``."""
        self._change_deg = self._target_deg = self.deg

    @property
    def can_stop(self) -> bool:
        """True if the feed-forward can stop within one setpoint."""
        return bool((np.abs(self._change_deg) <= self._closing_step_deg + _ROUNDING_DEG).all())

    def follow(self, target_deg: Floats, second_difference_deg: Floats) -> None:
        """Move with a target ``(5,)``. ``second_difference_deg`` limits the change of the step.

        The feed-forward makes the same step as its target. If it has fallen behind, it also catches up, and stops at a target that stands
        still.
        """
        behind_deg = self._target_deg - self.deg
        closing_deg = np.minimum(self._closing_step_deg, longest_steps(np.abs(behind_deg), second_difference_deg))
        step_deg = target_deg - self._target_deg + clip(behind_deg, -closing_deg, closing_deg)
        change_deg = clip(
            clip(step_deg, -self._largest_step_deg, self._largest_step_deg),
            self._change_deg - second_difference_deg,
            self._change_deg + second_difference_deg,
        )
        self.deg, self._change_deg, self._target_deg = self.deg + change_deg, change_deg, target_deg

    def hold(self, deg: Floats) -> None:
        """Replace the feed-forward by the one that the limits of setpoints allow. The next step starts from there, and not from beyond a limit."""
        self._change_deg = self._change_deg + deg - self.deg
        self.deg = deg


def clip(values: Floats, lowest: Floats, highest: Floats) -> Floats:
    """Clip the values. This takes a fifth of the time of np.clip."""
    bounded: Floats = np.minimum(np.maximum(values, lowest), highest)
    return bounded


class SetpointBrake:
    """Holds the last setpoint of a run. A setpoint that leads the reference would otherwise reach a limit at full speed."""

    def __init__(self, second_difference_deg: Floats) -> None:
        """``second_difference_deg``: largest change of a setpoint's step, ``(5,)``."""
        self._second_difference_deg = second_difference_deg
        self.start(np.zeros_like(second_difference_deg))

    def start(self, here_deg: Floats) -> None:
        """Start at rest at ``here_deg``, ``(5,)``."""
        self._setpoint_deg = self._wanted_deg = here_deg
        self._change_deg = self._wanted_change_deg = np.zeros(len(here_deg))

    @property
    def stop_deg(self) -> Floats:
        """Where the setpoint can stop, ``(5,)``."""
        step_deg = np.abs(self._change_deg)
        more = np.floor(step_deg / self._second_difference_deg)
        way_deg = more * step_deg - self._second_difference_deg * more * (more + 1) / 2
        stop: Floats = self._setpoint_deg + np.sign(self._change_deg) * way_deg
        return stop

    def only_inwards(self, lowest_deg: Floats, highest_deg: Floats, tight_deg: Limits) -> tuple[Floats, Floats]:
        """Return widened limits ``(5,)`` without the arm that lags behind the setpoint. A drive with little damping is braked by a setpoint
        that comes back, and outside the tight limits it must not.
        """
        tight_lowest, tight_highest = np.array(tight_deg).T
        last_deg, stop_deg = self._setpoint_deg, self.stop_deg
        lowest_deg = np.maximum(lowest_deg, np.minimum(tight_lowest, np.minimum(last_deg, stop_deg)))
        highest_deg = np.minimum(highest_deg, np.maximum(tight_highest, np.maximum(last_deg, stop_deg)))
        return lowest_deg, highest_deg

    def setpoint(self, wanted_deg: Floats, lowest_deg: Floats, highest_deg: Floats) -> Floats:
        """Return the wanted setpoint ``(5,)``, or the nearest one from which the setpoint can still stop at the limits.

        A setpoint that has fallen behind comes back to the wanted one as fast as the acceleration limit allows. A wanted setpoint that
        jerks by itself is not smoothed: the setpoint gate refuses it.
        """
        last_deg, behind_deg = self._setpoint_deg, self._wanted_deg - self._setpoint_deg
        second_difference, wanted_change_deg = self._second_difference_deg, wanted_deg - self._wanted_deg
        # A wanted setpoint may pass a held one at any speed. Only a setpoint that has moved with it makes its next step unlimited.
        together = (behind_deg == 0.0) & (self._change_deg == self._wanted_change_deg)
        change_limit = np.where(together, np.inf, second_difference)
        left_deg = np.array([highest_deg - last_deg, last_deg - lowest_deg, np.abs(behind_deg)])
        up_deg, down_deg, caught_up_deg = longest_steps(np.maximum(left_deg, 0.0), second_difference)
        most_deg = np.minimum(up_deg, self._change_deg + change_limit)
        least_deg = np.maximum(-down_deg, self._change_deg - change_limit)
        change_deg = wanted_change_deg + clip(behind_deg, -caught_up_deg, caught_up_deg)
        braked_deg = last_deg + clip(change_deg, least_deg, most_deg)
        setpoint_deg: Floats = np.where(np.abs(braked_deg - wanted_deg) < _ROUNDING_DEG, wanted_deg, braked_deg)
        self._wanted_deg, self._setpoint_deg = wanted_deg, setpoint_deg
        self._change_deg, self._wanted_change_deg = setpoint_deg - last_deg, wanted_change_deg
        return setpoint_deg
