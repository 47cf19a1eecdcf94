"""The methods of playing a recording, and the reference and feed-forward of each.

========= ====================================================================================================
paper     As Sun et al. (2025): 10 Hz, zero-order hold, no approach. For comparison.
smooth    The smoothed recording at the loop's rate, plus a feed-forward for the known lag of the drives.
learned   As smooth, plus a correction learned from earlier repetitions (:mod:`kata.motion.ilc`).
========= ====================================================================================================
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.trajectory import HOLD_S, Trajectory, ZeroOrderHold

Method = Literal["paper", "smooth", "learned"]
PAPER_HZ: Final = round(1 / HOLD_S)
_TURNING_DEG_S: Final = 5.0
"""Friction changes its sign over about this speed: an arm that hardly moves has no direction for a compensation yet."""


def rate_hz(method: Method, station_hz: int) -> int:
    """Return the setpoints and samples a second of a run, at a station whose own rate is ``station_hz``."""
    return PAPER_HZ if method == "paper" else station_hz


def reference(method: Method, times_s: ArrayLike, angles_deg: ArrayLike) -> Trajectory:
    """Return the reference of a recording: ``times_s`` is ``(n,)``, ``angles_deg`` ``(n, 5)``.

    :raises TrajectoryError: when this is not a recording.
    """
    return ZeroOrderHold(times_s, angles_deg) if method == "paper" else Trajectory(times_s, angles_deg)


@dataclass(frozen=True)
class ServoModel:
    """The lag of one station's drives behind their setpoints, ``(5,)`` each; all 0 if it has not been identified.

    A position loop answers to low frequencies as 1 / (1 + a1 s + a2 s^2), and friction holds it back by a constant.
    """

    first_s: Floats
    second_s2: Floats
    friction_deg: Floats

    def feed_forward(self, motion: PathPoint) -> Floats:
        """Return how far the setpoint must be ahead of the reference for the arm to be on the reference, ``(5,)`` in
        degrees.

        ``u - r = a1 r' + a2 r'' + f tanh(r' / v0)``; 0 at rest.
        """
        feed_forward: Floats = (
            self.first_s * motion.speed_deg_s
            + self.second_s2 * motion.acceleration_deg_s2
            + self.friction_deg * np.tanh(motion.speed_deg_s / _TURNING_DEG_S)
        )
        return feed_forward
