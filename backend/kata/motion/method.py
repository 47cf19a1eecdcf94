"""Defines the methods of playing a recording, with the reference and feed-forward of each method.

========= ====================================================================================================
paper     As Sun et al. (2025): 10 Hz, zero-order hold, no approach. For comparison.
smooth    The smoothed recording at the loop's rate, plus a feed-forward for the known lag of the drives.
learned   As smooth, plus a correction learned from earlier repetitions (:mod:`kata.motion.ilc`).
========= ====================================================================================================
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.arm_load import ArmLoad, load_terms
from kata.motion.axes import CANONICAL_SIDE, N_AXES, Side
from kata.motion.filters import recursive
from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.rigid_body import arm_motion
from kata.motion.trajectory import HOLD_S, Trajectory, ZeroOrderHold

Method = Literal["paper", "smooth", "learned"]
PAPER_HZ: Final = round(1 / HOLD_S)
TURNING_DEG_S: Final = 5.0
"""Friction changes its sign over about this range of speeds. Below it an arm has no clear direction for a compensation."""


def rate_hz(method: Method, station_hz: int) -> int:
    """Return the rate in Hz of a run's setpoints and samples, at a station with the rate ``station_hz``."""
    return PAPER_HZ if method == "paper" else station_hz


def reference(method: Method, times_s: ArrayLike, angles_deg: ArrayLike) -> Trajectory:
    """Return the reference of a recording: ``times_s`` is ``(n,)``, ``angles_deg`` ``(n, 5)``.

    :raises TrajectoryError: when the arrays are not a valid recording.
    """
    return ZeroOrderHold(times_s, angles_deg) if method == "paper" else Trajectory(times_s, angles_deg)


def _none() -> Floats:
    return np.zeros(N_AXES)


@dataclass(frozen=True)
class LoadModel:
    """Model of the torque that a station's drives need to move an arm; ``(5,)`` each. All values are 0 if it is not identified.

    m = b y' + j y'' + c tanh(y' / v0) + share arm(y, y', y'')

    The first three terms belong to each motor alone. The arm couples the motors (:mod:`kata.motion.arm_load`).
    """

    damping_nm_s_deg: Floats = field(default_factory=_none)
    inertia_nm_s2_deg: Floats = field(default_factory=_none)
    coulomb_nm: Floats = field(default_factory=_none)
    share: Floats = field(default_factory=lambda: np.ones(N_AXES))
    """Torque that a drive reports for 1 Nm. Magnets and gears differ by some percent."""
    arm: ArmLoad = field(default_factory=ArmLoad)
    side: Side = CANONICAL_SIDE

    @property
    def known(self) -> bool:
        """True if the load has been identified."""
        return self.arm.known

    @cached_property
    def _factors(self) -> Floats:
        return self.arm.factors

    def arm_nm(self, motion: PathPoint) -> Floats:
        """Return the torque of the arm, ``(5,)`` or ``(n, 5)``; 0 where the load is unknown."""
        torque: Floats = self.share * (load_terms(arm_motion(motion, self.side), self.arm.balancer_m) @ self._factors)
        return torque

    def torque_nm(self, motion: PathPoint) -> Floats:
        """Return the torque that the drives need for a motion, ``(5,)`` or ``(n, 5)``; 0 if the load is not identified."""
        torque: Floats = (
            self.arm_nm(motion)
            + self.damping_nm_s_deg * motion.speed_deg_s
            + self.inertia_nm_s2_deg * motion.acceleration_deg_s2
            + self.coulomb_nm * np.tanh(motion.speed_deg_s / TURNING_DEG_S)
        )
        return torque


@dataclass(frozen=True)
class ServoModel:
    """Model of the lag of a station's drives behind their setpoints; ``(5,)`` each. All values are 0 if it is not identified.

    The position control of a drive responds at low frequencies as 1 / (1 + a1 s + a2 s^2). Friction and the arm add to
    the lag. The drive's integral gain removes the whole lag with a time constant:

        u - y = H [a1 y' + a2 y'' + f tanh(y' / v0) + d arm(y, y', y'')],        H = s / (s + 1 / integral_s)
    """

    first_s: Floats
    second_s2: Floats
    friction_deg: Floats
    integral_s: Floats = field(default_factory=_none)
    """Time constant of the integral; 0 if the drive's integral does not remove the lag (H = 1)."""
    droop_deg_nm: Floats = field(default_factory=_none)
    """``d``: lag in deg for each Nm of the arm."""
    load: LoadModel = field(default_factory=LoadModel)

    def feed_forward(self, motion: PathPoint) -> Floats:
        """Return the lag of a motion without the effect of the drives' integral, ``(5,)`` in degrees.

        ``a1 r' + a2 r'' + f tanh(r' / v0) + d arm(r, r', r'')``.
        """
        lag: Floats = (
            self.first_s * motion.speed_deg_s
            + self.second_s2 * motion.acceleration_deg_s2
            + self.friction_deg * np.tanh(motion.speed_deg_s / TURNING_DEG_S)
        )
        return lag + self.droop_deg_nm * self.load.arm_nm(motion) if self.load.known else lag

    def integrated_share(self, step_s: float) -> Floats:
        """Return the share of a lag that the drives' integral removes in ``step_s``, ``(5,)``."""
        known = self.integral_s > 0.0
        share: Floats = np.where(known, -np.expm1(-step_s / np.where(known, self.integral_s, 1.0)), 0.0)
        return share


def after_integral(lag_deg: Floats, share: Floats) -> Floats:
    """Return the part of a lag ``(n, 5)`` that remains after the drives' integral has reacted, starting at rest.

    :param share: :meth:`ServoModel.integrated_share` of one row.
    """
    left = [
        recursive([1.0 - taken, taken - 1.0], [1.0, taken - 1.0], column) if taken else column
        for column, taken in zip(lag_deg.T, share.tolist(), strict=True)
    ]
    return np.column_stack(left)


class FeedForward:
    """Calculates how far the setpoint must lead the reference so that the arm follows it. It starts when torque is switched on."""

    def __init__(self, model: ServoModel, step_s: float) -> None:
        """Start with no lag removed by the integral. ``step_s``: time between two setpoints."""
        self._model = model
        self._share = model.integrated_share(step_s)
        self._integrated_deg: Floats = np.zeros(N_AXES)

    def at(self, motion: PathPoint) -> Floats:
        """Return the feed-forward of the next setpoint, ``(5,)`` in degrees. It is 0 at rest when the integral has removed the
        lag of the weight.
        """
        lag = self._model.feed_forward(motion)
        self._integrated_deg = self._integrated_deg + self._share * (lag - self._integrated_deg)
        return lag - self._integrated_deg
