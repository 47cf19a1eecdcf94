"""Identifies a station's drives and the load on them from measured movements.

The model is :class:`kata.motion.method.ServoModel`. For each axis, with the setpoint ``u``, the measured angle ``y`` and the drive's
torque ``m`` at the same time:

    m = b y' + j y'' + c tanh(y' / v0) + share arm(y, y', y'')
    u - y = H [a y' + e y'' + d m],        H = s / (s + 1 / integral_s)

All motors move the same arm, so the first line is fitted to all of them at once. The second line is linear for a given ``integral_s``, which is searched. In some drives
the integral removes the lag of the load but not the lag of the movement, for example in a cascade of position and speed
control. Such a drive is described without the integral:

    u - y = a1 y' + a2 y'' + f tanh(y' / v0) + constant

Both models need a movement without compensation, fast and slow, in both directions, through the postures that will be played.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.arm_load import N_TERMS, ArmLoad, load_terms
from kata.motion.axes import CANONICAL_SIDE, N_AXES, Side
from kata.motion.identify import filtered
from kata.motion.linkage import Floats
from kata.motion.method import TURNING_DEG_S, after_integral
from kata.motion.path import PathPoint
from kata.motion.rigid_body import N_INERTIAL, ArmMotion, arm_motion

_KNOWN_NM: Final = 0.3
_APART_S: Final = 0.25
"""Strength of the prior: torques this far apart in time are known to this precision. The prior draws numbers that a movement does not measure to
the usual values below. Without it, a small or slow movement gives large numbers of opposite signs, which are wrong for other movements."""
_SAMPLE_S: Final = 0.05
"""Time between the samples to which the load is fitted. The filtered movement has no frequency above 4 Hz."""
_OWN_SPREAD: Final = (0.01, 0.001, 0.5)
"""Spread of a drive's torque for each deg/s and for each deg/s2, and of its friction; the usual values are 0. A rotor of 1e-6 kg m2 behind a gear of
270 : 1 has 0.0013 Nm for each deg/s2. A much larger spread lets the fit take what the model of the arm does not explain for a heavy rotor, and the
feed-forward of a fast start is too large."""
_USUAL_ARM: Final = (0.06, 0.0, 0.20, 0.0, -0.08, 0.0, 0.25, 0.0, -0.75, 3.6, 0.0, 0.0, 0.0, 15.0)
"""Usual factors of :func:`~kata.motion.arm_load.load_terms`: an arm of 3.6 kg with the elbow at 80 deg (Winter 2009, table 4.1, a body of 72 kg) and
the middle of the balancer's range, 10 to 20 N (the paper's Table 1)."""
_ARM_SPREAD: Final = (0.06, 0.02, 0.10, 0.03, 0.05, 0.03, 0.12, 0.05, 0.25, 1.5, 0.5, 6.0, 6.0, 5.0)
_USUAL_BALANCER_M: Final = (0.05, -0.3, 1.0)
"""The hook is near the elbow; the apparatus is 2 m high."""
_BALANCER_SPREAD_M: Final = (0.05, 0.05, 0.3)
_SHARE_SPREAD: Final = 0.06
"""Spread of the logarithm of the torque that drives of one model report for the same load."""
_CLEARLY: Final = 0.8
"""The model with the integral is used only if its error is below this share of the error without it."""
_INTEGRALS_S: Final = tuple(np.geomspace(0.05, 5.0, 25).tolist())
"""Time constants that are tried. An integral slower than the last one has no effect."""
_PARTS: Final = 8
"""Parts of the movement that are left out in turn to estimate the confidence interval."""
_T_95: Final = 2.36
"""Student's t for 95 % and 7 degrees of freedom."""


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
    torque_share: float
    residual_deg: float
    residual_nm: float
    r_squared: float = 1.0
    """Share of the variance of setpoint minus angle that the model explains (R²), 0 to 1."""
    lag_uncertainty_s: float = 0.0
    """Half of the 95 % confidence interval of ``lag_s``."""


class IdentifiedLoad(NamedTuple):
    """The drives, and the arm that all of them move."""

    axes: tuple[IdentifiedAxis, ...]
    arm: ArmLoad


def identify_load(
    times_s: ArrayLike,
    setpoint_deg: ArrayLike,
    measured_deg: ArrayLike,
    torque_nm: ArrayLike,
    side: Side = CANONICAL_SIDE,
) -> IdentifiedLoad:
    """Return drive and load of each axis.

    :param times_s: ``(n,)``, times of the measurement, evenly spaced to within a tenth of a step.
    :param setpoint_deg: ``(n, 5)``, setpoints at these times.
    :param measured_deg: ``(n, 5)``, measured angles at these times.
    :param torque_nm: ``(n, 5)``, torques that the drives reported at these times.
    :raises ValueError: when the samples are too few or uneven, or an axis did not move.
    """
    movement = filtered(times_s, setpoint_deg, measured_deg, torque_nm)
    setpoint, measured, torque = movement.series
    speed, acceleration = movement.speed_deg_s, movement.acceleration_deg_s2
    own = np.stack([speed, acceleration, np.tanh(speed / TURNING_DEG_S)], axis=-1)
    some = slice(None, None, max(1, round(_SAMPLE_S / movement.step_s)))
    motion = PathPoint(measured[some], speed[some], acceleration[some])
    drives, arm, residual_nm = _load(own[some], arm_motion(motion, side), torque[some])
    axes = tuple(
        _axis(own[:, n], (setpoint - measured)[:, n], torque[:, n], movement.step_s, drives[n], residual_nm[n])
        for n in range(N_AXES)
    )
    return IdentifiedLoad(axes, arm)


def _load(own: Floats, arm: ArmMotion, torque_nm: Floats) -> tuple[Floats, ArmLoad, Floats]:
    """Return each motor's damping, inertia, friction and share ``(5, 4)``, the arm, and the RMS error of each motor's torque.

    All are linear but the place of the balancer's cable and the shares, which are searched.

    :param own: ``(n, 5, 3)``.
    """
    # Imported here: only a commissioning needs scipy, and every service would start later.
    from scipy.optimize import least_squares, lsq_linear

    separate = np.einsum("nmk,mj->nmjk", own, np.eye(N_AXES)).reshape(len(own), N_AXES, -1)
    n_own = separate.shape[-1]
    usual = np.array([*np.zeros(n_own), *_USUAL_ARM])
    known_nm = _KNOWN_NM * math.sqrt(_APART_S / _SAMPLE_S)
    certain = known_nm / np.array([*_OWN_SPREAD * N_AXES, *_ARM_SPREAD])
    values = np.concatenate([torque_nm.ravel(), certain * usual])
    # Friction and a rotor's inertia are never negative.
    lowest = np.array([*np.zeros(n_own), *np.full(N_TERMS, -np.inf)])
    start = np.array([*_USUAL_BALANCER_M, *np.zeros(N_AXES)])
    spread = np.array([*_BALANCER_SPREAD_M, *np.full(N_AXES, _SHARE_SPREAD)])

    def solved(searched: Floats) -> tuple[Floats, Floats]:
        common = load_terms(arm, searched[:3]) * np.exp(searched[3:, np.newaxis])
        columns = np.concatenate([separate, common], axis=-1).reshape(-1, len(usual))
        rows = np.vstack([columns, np.diag(certain)])
        # The triangular factor has the same least squares as its thousands of rows.
        triangle: Floats = np.asarray(np.linalg.qr(np.column_stack([rows, values]), mode="r"))
        factors = lsq_linear(triangle[:, :-1], triangle[:, -1], (lowest, np.inf), method="bvls").x
        return factors, rows @ factors - values

    def errors(searched: Floats) -> Floats:
        return np.concatenate([solved(searched)[1], known_nm * (searched - start) / spread])

    searched = least_squares(errors, start).x
    factors, residual = solved(searched)
    residual_nm = np.sqrt(np.mean(residual[: torque_nm.size].reshape(torque_nm.shape) ** 2, axis=0))
    inertia, (link_nm, *girdle, balancer_n) = np.split(factors[n_own:], [N_INERTIAL])
    arm_load = ArmLoad(
        inertia=tuple(inertia.tolist()),
        link_nm=float(link_nm),
        girdle_nm_rad=(float(girdle[0]), float(girdle[1])),
        balancer_n=float(balancer_n),
        balancer_m=tuple(searched[:3].tolist()),
    )
    drives = np.column_stack([factors[:n_own].reshape(N_AXES, -1), np.exp(searched[3:])])
    return drives, arm_load, residual_nm


def _axis(
    moved: Floats, lag_deg: Floats, torque_nm: Floats, step_s: float, drive: Floats, residual_nm: float
) -> IdentifiedAxis:
    """``moved``: speed, acceleration and direction, ``(n, 3)``. ``drive``: damping, inertia, friction and share."""
    damping, inertia, coulomb, share = drive.tolist()
    driven = np.column_stack([moved[:, :2], torque_nm])

    def columns_with(integral_s: float) -> Floats:
        taken = np.full(driven.shape[1], -np.expm1(-step_s / integral_s))
        begins = np.exp(-np.arange(len(driven)) * step_s / integral_s)
        return np.column_stack([after_integral(driven, taken), begins])

    def fit_with(integral_s: float) -> tuple[Floats, float]:
        return _fitted(columns_with(integral_s), lag_deg)

    columns, lag_of = np.column_stack([moved, np.ones(len(moved))]), np.array([1.0, 0.0, 0.0, 0.0])
    (first_s, second_s2, friction, _), residual_deg = _fitted(columns, lag_deg)
    integral_s = droop = 0.0
    near = int(np.argmin([fit_with(tried)[1] for tried in _INTEGRALS_S]))
    if 0 < near < len(_INTEGRALS_S) - 1:
        # Import here, because only commissioning needs this part of scipy. Otherwise every service would start later.
        from scipy.optimize import minimize_scalar

        bounds = math.log(_INTEGRALS_S[near - 1]), math.log(_INTEGRALS_S[near + 1])
        best = minimize_scalar(lambda log_s: fit_with(math.exp(log_s))[1], bounds=bounds, method="bounded")
        (own_s, own_s2, per_nm, _), left_deg = fit_with(math.exp(best.x))
        if left_deg < _CLEARLY * residual_deg and per_nm > 0.0:
            integral_s, droop, residual_deg = math.exp(best.x), float(per_nm), left_deg
            first_s, second_s2, friction = own_s + droop * damping, own_s2 + droop * inertia, droop * coulomb
            columns, lag_of = columns_with(integral_s), np.array([1.0, 0.0, damping, 0.0])
    return IdentifiedAxis(
        lag_s=float(first_s),
        lag2_s2=float(second_s2),
        friction_deg=float(friction),
        integral_s=integral_s,
        droop_deg_nm=droop,
        damping_nm_s_deg=damping,
        inertia_nm_s2_deg=inertia,
        coulomb_nm=coulomb,
        torque_share=share,
        residual_deg=residual_deg,
        residual_nm=float(residual_nm),
        r_squared=1.0 - residual_deg**2 / lead if (lead := float(np.var(lag_deg))) > 0.0 else 0.0,
        lag_uncertainty_s=_uncertainty(columns, lag_deg, lag_of),
    )


def _fitted(columns: Floats, values: Floats) -> tuple[Floats, float]:
    """Return the factors of the columns by least squares, and the RMS error."""
    factors = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=np.float64)
    return factors, float(np.sqrt(np.mean((values - columns @ factors) ** 2)))


def _uncertainty(columns: Floats, values: Floats, weights: Floats) -> float:
    """Return half of the 95 % confidence interval of the weighted sum of the fitted factors.

    The jackknife leaves out one part of the movement after the other, because errors of neighbouring samples are alike: the formula for
    independent errors would give a much smaller interval.
    """
    parts = np.array_split(np.arange(len(values)), _PARTS)
    sums = [float(weights @ _fitted(np.delete(columns, part, axis=0), np.delete(values, part))[0]) for part in parts]
    return _T_95 * math.sqrt((_PARTS - 1) * float(np.var(sums)))
