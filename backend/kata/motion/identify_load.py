"""Identifies a station's drives and the load on them from measured movements.

The model is :class:`kata.motion.method.ServoModel`. For each axis, with the setpoint ``u``, the measured angle ``y`` and the drive's
torque ``m`` at the same time:

    m = b y' + j y'' + c tanh(y' / v0) + weight(y)
    u - y = H [a y' + e y'' + d m],        H = s / (s + 1 / integral_s)

The first line is linear in its factors. The second line is linear for a given ``integral_s``, which is searched. In some drives
the integral removes the lag of the load but not the lag of the movement, for example in a cascade of position and speed
control. Such a drive is described without the integral:

    u - y = a1 y' + a2 y'' + f tanh(y' / v0) + constant

Both models need a movement without compensation, fast and slow, in both directions, through the postures that will be played.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.axes import CANONICAL_SIDE, N_AXES, Side
from kata.motion.identify import filtered
from kata.motion.linkage import Floats
from kata.motion.method import TURNING_DEG_S, without_taken_up
from kata.motion.weight import N_TERMS, weight_terms

_KNOWN_NM: Final = 1.5
"""Strength of the prior. It draws factors that a movement does not measure to 0. It assumes that torques a quarter of a second apart
are known to 0.3 Nm and that factors have the usual size below. Without it, a small or slow movement gives large factors of opposite
signs, which are wrong for other movements."""
_USUAL_MOVED: Final = (0.01, 0.01, 0.5)
"""Usual torque in Nm for each deg/s, for each deg/s2, and of friction."""
_USUAL_WEIGHT_NM: Final = (4.0, 4.0, 4.0, 1.0, 1.0, 1.0)
"""Usual factors of the weight terms in Nm. The last three are smaller, because the balancer cable's change of direction has less effect
than the load."""
_CLEARLY: Final = 0.8
"""The model with the integral is used only if its error is below this share of the error without it."""
_INTEGRALS_S: Final = tuple(np.geomspace(0.05, 5.0, 25).tolist())
"""Time constants that are tried. An integral slower than the last one has no effect."""


@dataclass(frozen=True)
class IdentifiedAxis:
    """The identified model of one axis. Names as in :class:`~kata.device.config.Axis`; residuals are RMS errors of the two model lines."""

    lag_s: float
    lag2_s2: float
    friction_deg: float
    integral_s: float
    droop_deg_nm: float
    damping_nm_s_deg: float
    inertia_nm_s2_deg: float
    coulomb_nm: float
    weight_nm: tuple[float, ...]
    residual_deg: float
    residual_nm: float
    explained: float = 1.0
    """Share of the setpoint's lead over the angle that the model explains, 0 to 1."""


def identify_load(
    times_s: ArrayLike,
    setpoint_deg: ArrayLike,
    measured_deg: ArrayLike,
    torque_nm: ArrayLike,
    side: Side = CANONICAL_SIDE,
) -> tuple[IdentifiedAxis, ...]:
    """Return drive and load of each axis.

    :param times_s: ``(n,)``, times of the measurement, evenly spaced to within a tenth of a step.
    :param setpoint_deg: ``(n, 5)``, setpoints at these times.
    :param measured_deg: ``(n, 5)``, measured angles at these times.
    :param torque_nm: ``(n, 5)``, torques that the drives reported at these times.
    :raises ValueError: when the samples are too few or uneven, or an axis did not move.
    """
    movement = filtered(times_s, setpoint_deg, measured_deg, torque_nm)
    setpoint, measured, torque = movement.series
    terms = weight_terms(measured, side)
    found = []
    for n in range(N_AXES):
        speed = movement.speed_deg_s[:, n]
        moved = np.column_stack(
            [speed, movement.acceleration_deg_s2[:, n], np.tanh(speed / TURNING_DEG_S), terms[:, n]]
        )
        found.append(_axis(moved, (setpoint - measured)[:, n], torque[:, n], movement.step_s))
    return tuple(found)


def _axis(moved: Floats, lag_deg: Floats, torque_nm: Floats, step_s: float) -> IdentifiedAxis:
    """Identify one axis. ``moved``: speed, acceleration, direction and the terms of weight, ``(n, 3 + N_TERMS)``."""
    prior = np.diag(_KNOWN_NM / np.array([*_USUAL_MOVED, *_USUAL_WEIGHT_NM]))
    factors, *_ = np.linalg.lstsq(
        np.vstack([moved, prior]), np.concatenate([torque_nm, np.zeros(len(prior))]), rcond=None
    )
    residual_nm = float(np.sqrt(np.mean((torque_nm - moved @ factors) ** 2)))
    damping, inertia, coulomb = factors[:3].tolist()
    driven = np.column_stack([moved[:, :2], torque_nm])

    def taken_up(integral_s: float) -> tuple[Floats, float]:
        share = np.full(driven.shape[1], -np.expm1(-step_s / integral_s))
        begins = np.exp(-np.arange(len(driven)) * step_s / integral_s)
        return _fitted(np.column_stack([without_taken_up(driven, share), begins]), lag_deg)

    (first_s, second_s2, friction, _), residual_deg = _fitted(
        np.column_stack([moved[:, :3], np.ones(len(moved))]), lag_deg
    )
    integral_s = droop = 0.0
    near = int(np.argmin([taken_up(tried)[1] for tried in _INTEGRALS_S]))
    if 0 < near < len(_INTEGRALS_S) - 1:
        # Import here, because only commissioning needs this part of scipy. Otherwise every service would start later.
        from scipy.optimize import minimize_scalar

        bounds = math.log(_INTEGRALS_S[near - 1]), math.log(_INTEGRALS_S[near + 1])
        best = minimize_scalar(lambda log_s: taken_up(math.exp(log_s))[1], bounds=bounds, method="bounded")
        (own_s, own_s2, per_nm, _), left_deg = taken_up(math.exp(best.x))
        if left_deg < _CLEARLY * residual_deg and per_nm > 0.0:
            integral_s, droop, residual_deg = math.exp(best.x), float(per_nm), left_deg
            first_s, second_s2, friction = own_s + droop * damping, own_s2 + droop * inertia, droop * coulomb
    return IdentifiedAxis(
        lag_s=float(first_s),
        lag2_s2=float(second_s2),
        friction_deg=float(friction),
        integral_s=integral_s,
        droop_deg_nm=droop,
        damping_nm_s_deg=damping,
        inertia_nm_s2_deg=inertia,
        coulomb_nm=coulomb,
        weight_nm=tuple(factors[3 : 3 + N_TERMS].tolist()),
        residual_deg=residual_deg,
        residual_nm=residual_nm,
        explained=1.0 - residual_deg**2 / lead if (lead := float(np.var(lag_deg))) > 0.0 else 0.0,
    )


def _fitted(columns: Floats, values: Floats) -> tuple[Floats, float]:
    """Return the factors of the columns by least squares, and the RMS error."""
    factors = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=np.float64)
    return factors, float(np.sqrt(np.mean((values - columns @ factors) ** 2)))
