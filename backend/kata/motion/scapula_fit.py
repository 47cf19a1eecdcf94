"""Calculates the scapula's pose and the swing of its ball joints as polynomials of the angles of motors 1 and 2.

The forward kinematics needs a root finder (:mod:`kata.motion.linkage`), which is too slow for every setpoint and for an hour
of samples. Within :data:`FITTED_DEG` the polynomials differ from it by less than 0.01 deg (a test compares them).
"""

from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval2d

from kata.motion.axes import APPARATUS_SIGNS, Side
from kata.motion.linkage import LINKAGE, Floats

FITTED_DEG: Final = 28.0
"""Largest phi and psi of the fit. Table 2 needs 20 deg, and setpoints may be some degrees beyond."""
BALL_JOINT_DEG: Final = 30.0
"""Swing limit of the ball joints, in each direction (Table 1, HEPHAIST SRJ012C)."""
_DEGREE: Final = 7
_GRID: Final = 57
_MIDDLE_DEG: Final = (12.0, 108.0)
_WIDTH_DEG: Final = (40.0, 30.0)
"""Middle and width scale the motors' angles to about -1 to 1, so that the fit is well conditioned."""


class Scapula(NamedTuple):
    """Angles of the scapula and the largest swing of its ball joints, in degrees. All three have the same shape."""

    phi_deg: Floats
    psi_deg: Floats
    swing_deg: Floats


def ball_joint_swing_deg(scapula_deg: Floats) -> Floats:
    """Return the angles in deg by which the four ball joints have turned from the middle pose.

    The orientation of their housings is not published. We assume that each joint is centred at phi = psi = 0, and that each rod
    has one joint on the board and one on the crank.

    :param scapula_deg: shape ``(n, 2)``, in the coordinates of the apparatus.
    :returns: shape ``(n, 4)``: Q1, P1, Q2, P2.
    """
    turned, middle = _rods(np.radians(scapula_deg)), _rods(np.zeros((1, 2)))
    swings = [
        np.degrees(np.arccos(np.clip(rod @ centre[0], -1.0, 1.0))) for rod, centre in zip(turned, middle, strict=True)
    ]
    return np.stack(swings, axis=-1)


def scapula_of(motors_deg: Floats, side: Side) -> Scapula:
    """Return the scapula's pose for motor angles.

    Far outside the linkage's reach the values have no meaning, but they are outside every limit.

    :param motors_deg: shape ``(n, 2)`` or more columns; motors 1 and 2 come first.
    """
    u, v = ((motors_deg[:, n] - _MIDDLE_DEG[n]) / _WIDTH_DEG[n] for n in (0, 1))
    phi, psi, cosine = (polyval2d(u, v, table) for table in coefficients())
    signs = APPARATUS_SIGNS[side]
    return Scapula(signs[0] * phi, signs[1] * psi, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def scapula_at(motor_1_deg: float, motor_2_deg: float) -> tuple[float, float, float]:
    """Return phi and psi in the coordinates of the apparatus, and the cosine of the largest swing. This is :func:`scapula_of`
    for one pose, in a hundredth of the time.
    """
    u = (motor_1_deg - _MIDDLE_DEG[0]) / _WIDTH_DEG[0]
    v = (motor_2_deg - _MIDDLE_DEG[1]) / _WIDTH_DEG[1]
    totals = []
    for rows in horner_coefficients():
        total = 0.0
        for row in rows:
            inner = 0.0
            for coefficient in row:
                inner = inner * v + coefficient
            total = total * u + inner
        totals.append(total)
    return totals[0], totals[1], totals[2]


@cache
def coefficients() -> Floats:
    """Return the polynomials' coefficients, shape ``(3, 8, 8)``: those of phi, of psi, and of the cosine of the largest swing."""
    line = np.linspace(-FITTED_DEG, FITTED_DEG, _GRID)
    scapula = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    scaled = (LINKAGE.inverse_deg(scapula) - _MIDDLE_DEG) / _WIDTH_DEG
    powers = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
    terms = np.stack([scaled[:, 0] ** i * scaled[:, 1] ** j for i, j in powers], axis=-1)
    # If any joint swings far, the joint at the end of motor 2's crank swings farthest.
    targets = np.column_stack([scapula, np.cos(np.radians(ball_joint_swing_deg(scapula)[:, 3]))])
    fitted = np.linalg.lstsq(terms, targets, rcond=None)[0]
    tables = np.zeros((3, _DEGREE + 1, _DEGREE + 1))
    for (i, j), values in zip(powers, fitted, strict=True):
        tables[:, i, j] = values
    return tables


@cache
def horner_coefficients() -> tuple[tuple[tuple[float, ...], ...], ...]:
    """Return the coefficients for Horner's scheme: the highest power first, without the zeros. The first call fits them, which takes
    longer than a control cycle.
    """
    return tuple(
        tuple(tuple(row[: _DEGREE + 1 - i][::-1].tolist()) for i, row in reversed(list(enumerate(table))))
        for table in coefficients()
    )


def _rods(scapula_rad: Floats) -> list[Floats]:
    """Return the direction of each rod in the coordinates of its two joints, ``(n, 3)`` each: on the board, then on the crank."""
    phi, psi = scapula_rad.T
    directions = []
    for leg in LINKAGE.legs:
        theta = leg.close(phi, psi)
        rod = np.stack(leg.board(phi, psi), axis=-1) - np.stack(leg.crank(theta), axis=-1)
        rod /= np.linalg.norm(rod, axis=-1, keepdims=True)
        directions.append(np.einsum("nji,nj->ni", _board_turn(phi, psi), rod))
        directions.append(np.stack(_on_crank(rod, theta, leg.sine, leg.cosine), axis=-1))
    return directions


def _board_turn(phi: Floats, psi: Floats) -> Floats:
    """Return the board's rotation ``(n, 3, 3)``: roll psi about Y, then yaw phi about Z."""
    zero, one = np.zeros_like(phi), np.ones_like(phi)
    yaw = np.array([[np.cos(phi), -np.sin(phi), zero], [np.sin(phi), np.cos(phi), zero], [zero, zero, one]])
    roll = np.array([[np.cos(psi), zero, np.sin(psi)], [zero, one, zero], [-np.sin(psi), zero, np.cos(psi)]])
    turn: Floats = np.einsum("ijn,jkn->nik", yaw, roll)
    return turn


def _on_crank(
    rod: Floats, theta: Floats, sine: tuple[int, float], cosine: tuple[int, float]
) -> tuple[Floats, Floats, Floats]:
    """Return the rod's components along the crank, across the crank in its plane, and along the crank's axis."""
    in_plane = {sine[0]: sine[1], cosine[0]: cosine[1]}
    (axis,) = {0, 1, 2} - set(in_plane)
    a, b = sine[1] * rod[:, sine[0]], cosine[1] * rod[:, cosine[0]]
    along = a * np.sin(theta) + b * np.cos(theta)
    across = a * np.cos(theta) - b * np.sin(theta)
    return along, across, rod[:, axis]
