"""The ways of playing a recording, and what is asked of the drives in each.

========= ====================================================================================================
paper     As Sun et al. (2025) did: 10 Hz, each sample held until the next, no approach. To be compared with.
smooth    The smoothed recording at the loop's rate, with what the drives are known to lag behind added.
learned   As smooth, with a correction learned from earlier repetitions (:mod:`kata.motion.learning`).
========= ====================================================================================================
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.linkage import Floats
from kata.motion.path import Motion
from kata.motion.trajectory import HOLD_S, Held, Trajectory

Method = Literal["paper", "smooth", "learned"]
PAPER_HZ: Final = round(1 / HOLD_S)
_TURNING_DEG_S: Final = 5.0
"""Friction turns round over about this speed: an arm that hardly moves has no direction yet to be helped in."""


def rate_hz(method: Method, station_hz: int) -> int:
    """Setpoints and samples a second of a run, at a station whose own rate is ``station_hz``."""
    return PAPER_HZ if method == "paper" else station_hz


def reference(method: Method, times_s: ArrayLike, angles_deg: ArrayLike) -> Trajectory:
    """Where the arm is to be at each time of a recording: ``times_s`` is ``(n,)``, ``angles_deg`` ``(n, 5)``.

    :raises TrajectoryError: when this is no recording.
    """
    return Held(times_s, angles_deg) if method == "paper" else Trajectory(times_s, angles_deg)


@dataclass(frozen=True)
class Lag:
    """How the drives of one station fall behind their setpoints: ``(5,)`` each, all 0 when nothing is known.

    A position loop answers to low frequencies as 1 / (1 + a1 s + a2 s^2), and friction holds it back by a constant.
    """

    first_s: Floats
    second_s2: Floats
    friction_deg: Floats

    def ahead(self, motion: Motion) -> Floats:
        """How far before the reference the setpoint has to be for the arm to be on it, ``(5,)`` in degrees.

        ``u - r = a1 r' + a2 r'' + f tanh(r' / v0)``; where the arm is to stand, nothing.
        """
        ahead: Floats = (
            self.first_s * motion.speed_deg_s
            + self.second_s2 * motion.acceleration_deg_s2
            + self.friction_deg * np.tanh(motion.speed_deg_s / _TURNING_DEG_S)
        )
        return ahead
