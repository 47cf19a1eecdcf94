"""The mechanics: five motors with what hangs on them. Plain floats, one millisecond at a time.

Nothing here is measured on the apparatus: the paper gives torques and ranges, the rest is chosen so that a rated motor of
4 Nm carries the arm at 60 deg/s, and an arm let go sinks instead of falling. Angles in radians inside.
"""

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

STEP_S: Final = 0.001
_END_STIFFNESS_NM: Final = 300.0
_END_DAMPING_NM_S: Final = 6.0
_STILL_RAD_S: Final = 0.002


@dataclass(frozen=True)
class AxisParameters:
    """One axis. Gravity pulls towards ``hangs_deg`` with at most ``gravity_nm``, as a pendulum does."""

    inertia_kg_m2: float
    viscous_nm_s: float
    coulomb_nm: float
    gravity_nm: float
    hangs_deg: float
    ends_deg: tuple[float, float]
    rest_deg: float


PARAMETERS: Final = (
    AxisParameters(0.10, 0.5, 0.40, 0.4, 15.0, (-24.0, 47.0), 15.05),
    AxisParameters(0.10, 0.5, 0.40, 0.4, 109.0, (84.0, 133.0), 108.94),
    AxisParameters(0.16, 0.8, 0.70, 1.0, 0.0, (-5.0, 125.0), 8.0),
    AxisParameters(0.16, 0.8, 0.70, 1.0, 0.0, (-25.0, 195.0), 0.0),
    AxisParameters(0.04, 0.3, 0.35, 0.2, 0.0, (-95.0, 45.0), 0.0),
)
"""Axis order. Motor 5 turns little, but through a pinion with more friction for its size."""


class Plant:
    """Angles and speeds of the five axes, moved by torques."""

    def __init__(self, seed: int | None = None) -> None:
        """``seed`` varies inertia, friction and weight by up to 30 %, as patients and gears do."""
        vary = random.Random(seed).uniform if seed is not None else lambda low, high: 1.0
        self._axes = [
            (
                axis.inertia_kg_m2 * vary(0.7, 1.3),
                axis.viscous_nm_s * vary(0.7, 1.3),
                axis.coulomb_nm * vary(0.7, 1.3),
                axis.gravity_nm * vary(0.7, 1.3),
                math.radians(axis.hangs_deg),
                math.radians(axis.ends_deg[0]),
                math.radians(axis.ends_deg[1]),
            )
            for axis in PARAMETERS
        ]
        self.angle = [math.radians(axis.rest_deg) for axis in PARAMETERS]
        """Radians, axis order."""
        self.speed = [0.0] * len(PARAMETERS)
        """Radians a second, axis order."""
        self._jammed: set[int] = set()

    def jam(self, axis: int, *, jammed: bool) -> None:
        """A jammed shaft stays where it is, whatever pulls. ``axis`` from 0."""
        if jammed:
            self._jammed.add(axis)
            self.speed[axis] = 0.0
        else:
            self._jammed.discard(axis)

    def step(self, torque_nm: Sequence[float]) -> None:
        """Let one millisecond pass under these torques of motor and hand together."""
        for n, (inertia, viscous, coulomb, gravity, hangs, low, high) in enumerate(self._axes):
            if n in self._jammed:
                continue
            angle, speed = self.angle[n], self.speed[n]
            torque = torque_nm[n] - gravity * math.sin(angle - hangs)
            if angle < low:
                torque += (low - angle) * _END_STIFFNESS_NM - speed * _END_DAMPING_NM_S
            elif angle > high:
                torque += (high - angle) * _END_STIFFNESS_NM - speed * _END_DAMPING_NM_S
            if abs(speed) < _STILL_RAD_S and abs(torque) <= coulomb:
                self.speed[n] = 0.0
                continue
            torque -= viscous * speed + math.copysign(coulomb, speed if abs(speed) >= _STILL_RAD_S else torque)
            moved = speed + torque / inertia * STEP_S
            # Friction brings to rest, it does not turn round.
            if speed * moved < 0.0 and abs(torque_nm[n]) < coulomb:
                moved = 0.0
            self.speed[n] = moved
            self.angle[n] = angle + moved * STEP_S
