"""Brakes setpoints before a limit, so that they can always stop there within the axes' acceleration limits."""

from typing import Final

import numpy as np

from kata.device.movement import longest_step
from kata.motion.linkage import Floats

_ROUNDING_DEG: Final = 1e-9


class SetpointBrake:
    """Holds the last setpoint of a run. A setpoint that leads the reference would otherwise reach a limit at full speed."""

    def __init__(self, second_difference_deg: Floats) -> None:
        """``second_difference_deg``: largest change of a setpoint's step, ``(5,)``."""
        self._second_difference_deg = second_difference_deg
        self.start(np.zeros_like(second_difference_deg))

    def start(self, here_deg: Floats) -> None:
        """Start at rest at ``here_deg``, ``(5,)``."""
        self._setpoint_deg = self._wanted_deg = here_deg
        self._change_deg = np.zeros(len(here_deg))

    def setpoint(self, wanted_deg: Floats, lowest_deg: Floats, highest_deg: Floats) -> Floats:
        """Return the wanted setpoint ``(5,)``, or the nearest one from which the setpoint can still stop at the limits.

        A setpoint that has fallen behind comes back to the wanted one as fast as the acceleration limit allows. A wanted setpoint that
        jerks by itself is not smoothed: the setpoint gate refuses it.
        """
        last_deg, behind_deg = self._setpoint_deg, self._wanted_deg - self._setpoint_deg
        second_difference = self._second_difference_deg
        change_limit = np.where(behind_deg == 0.0, np.inf, second_difference)
        most_deg = np.minimum(
            longest_step(np.maximum(highest_deg - last_deg, 0.0), second_difference), self._change_deg + change_limit
        )
        least_deg = np.maximum(
            -longest_step(np.maximum(last_deg - lowest_deg, 0.0), second_difference), self._change_deg - change_limit
        )
        caught_up_deg = longest_step(np.abs(behind_deg), second_difference)
        catch_up_deg = np.minimum(np.maximum(behind_deg, -caught_up_deg), caught_up_deg)
        change_deg = wanted_deg - self._wanted_deg + catch_up_deg
        braked_deg = last_deg + np.minimum(np.maximum(change_deg, least_deg), most_deg)
        setpoint_deg: Floats = np.where(np.abs(braked_deg - wanted_deg) < _ROUNDING_DEG, wanted_deg, braked_deg)
        self._wanted_deg, self._setpoint_deg, self._change_deg = wanted_deg, setpoint_deg, setpoint_deg - last_deg
        return setpoint_deg
