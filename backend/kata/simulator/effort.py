"""Simulates the effort of a patient whom the apparatus moves: a torque along the path, forwards or backwards."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Final

from kata.simulator.hand import STRIDE_S
from kata.simulator.mechanics import Hand

MOST_NM: Final = 4.0
"""Largest effort. A larger one would move the arm against the drives' rated torque."""
_SEEN_S: Final = 0.3
_SEEN_RAD: Final = math.radians(0.3)
"""The patient feels a way of the setpoints of this length in this time."""
_SEARCHES_S: Final = 1.0
"""A patient who helps and feels no movement for this time tries the other direction."""


class PatientEffort:
    """A patient who helps or resists. The patient feels the direction of the path by the movement of the apparatus."""

    def __init__(self) -> None:
        """Begin relaxed."""
        self.effort_nm = 0.0
        """Torque along the path: above 0 the patient helps, below 0 the patient resists."""
        self._goals: deque[Sequence[float]] = deque(maxlen=round(_SEEN_S / STRIDE_S))
        self._unit: list[float] = []
        self._rests_s = 0.0

    def hands(self, goals: Sequence[float]) -> list[Hand] | None:
        """Return the torque on each axis for the next :data:`STRIDE_S`; None without effort or before the first movement.

        :param goals: present goals of the drives, rad. Call it also without effort, so that the last movement is known.
        """
        self._goals.append(goals)
        way = [last - first for first, last in zip(self._goals[0], goals, strict=True)]
        length = math.hypot(*way)
        self._rests_s += STRIDE_S
        if length >= _SEEN_RAD:
            self._unit, self._rests_s = [part / length for part in way], 0.0
        elif self._rests_s >= _SEARCHES_S and self.effort_nm > 0.0:
            self._unit, self._rests_s = [-part for part in self._unit], 0.0
        if not self.effort_nm or not self._unit:
            return None
        return [steady_push(self.effort_nm * part) for part in self._unit]


def steady_push(torque_nm: float) -> Hand:
    """Return a hand that adds a torque to the arm, in the direction of the axis' angle."""
    return (math.copysign(1000.0, torque_nm), 0.0, 1000.0, 0.0, abs(torque_nm))
