"""Defines the reachable set and a doctor's limits of the arm: the allowed poses, regardless of the motors that produce them.

Limits apply to the pose. Motor 4 produces flexion with the hanging arm and horizontal flexion with the level arm (Table 2,
rows 5 and 3), and its 190 deg are too far for an arm that is lifted sideways. The body's coordinates avoid this problem:

* the **scapula**: phi, psi, and the swing of the ball joints that hold it;
* **elevation**: the angle between the upper arm and the hanging arm, 0 to 180 deg;
* **plane of elevation**: the direction in which the arm is raised: 0 deg sideways, 90 deg forward, beyond it across
  the body, below 0 backward (the two angles of the International Society of Biomechanics, Wu et al. 2005,
  doi 10.1016/j.jbiomech.2004.05.042).

The motors' own ranges (Table 2, rows 3 to 6) are the station's axes. :mod:`kata.motion.pose_gate` checks the same limits for
one setpoint. A test compares the two modules.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from kata.messages import Text
from kata.motion import texts
from kata.motion.axes import BASIC_MOTIONS, POSE_RANGE_DEG, Side
from kata.motion.linkage import Floats
from kata.motion.scapula_fit import BALL_JOINT_DEG, Scapula, scapula_of
from kata.motion.trajectory import Trajectory, TrajectoryError

CROSS_BODY_DEG: Final = BASIC_MOTIONS[2].range_deg[1]
"""The furthest plane of elevation across the body: horizontal flexion of the level arm (Table 2, row 3)."""
OVERHEAD_DEG: Final = 165.0
"""Elevation from which the plane is not limited, because it has no meaning there. Row 5 extends 10 deg beyond the vertical.
For an arm that is 10 deg from the body, as it hangs in the apparatus, this is an elevation of 166 deg.
"""
RAISED_DEG: Final = (45.0, 135.0)
"""Elevations between which a doctor's limit of the plane applies fully. Nearer to the vertical a small movement changes the
plane a lot, so the limit widens by :data:`FADE`. These bounds are our choice.
"""
FADE: Final = 10.0
"""Widening of the plane's limit, in degrees of plane for each degree of elevation."""
LEVEL_BACK_DEG: Final = BASIC_MOTIONS[2].range_deg[0]
"""Lowest angle of motor 4 with the level arm (Table 2, row 3)."""
FREE_DEG: Final = 360.0
"""Means "no limit": no pose reaches this angle."""
PLANES_DEG: Final = (-180.0, -90.0, 0.0, 90.0, 180.0)
"""Planes in degrees for the values of :attr:`ArmLimits.elevations_deg`."""

POSE_ROUNDING_DEG: Final = 0.01
"""Accuracy of the scapula's pose (:mod:`kata.motion.scapula_fit`), used as a tolerance, so that a motion up to a limit is inside."""
_STEP_S: Final = 0.01
"""Time between two checked places of a motion: the setpoint period at 100 Hz."""
_CHUNK: Final = 65_536
"""Number of samples that are checked at once, to limit the memory for an hour of samples."""


@dataclass(frozen=True)
class ArmLimits:
    """A doctor's limits of the arm, in the body's coordinates. The default has no limits.

    Elevation and plane are relative to the trunk, as a goniometer measures them. They include the scapula's part.
    """

    scapula_deg: tuple[tuple[float, float], tuple[float, float]] = ((-FREE_DEG, FREE_DEG), (-FREE_DEG, FREE_DEG))
    """Lowest and highest phi and psi."""
    side_deg: float = 180.0
    """Highest elevation sideways. Between the directions the highest elevation is interpolated."""
    front_deg: float = 180.0
    """Highest elevation forward and across the body."""
    back_deg: float = 180.0
    """Highest elevation backward."""
    plane_deg: tuple[float, float] = (-FREE_DEG, FREE_DEG)
    """Lowest and highest plane of the raised arm."""
    flexion_from_deg: tuple[float, float] = (-FREE_DEG, -FREE_DEG)
    """Lowest angle of motor 4 with the hanging arm and with the level arm. Between them it is interpolated by the angle of motor 3."""

    @property
    def elevations_deg(self) -> tuple[float, ...]:
        """Return the highest elevation at each of :data:`PLANES_DEG`."""
        return self.front_deg, self.back_deg, self.side_deg, self.front_deg, self.front_deg


class Bound(NamedTuple):
    """One limit along a motion: ``(n,)`` each."""

    quantity: Text
    motor: int
    """The motor that an error message names."""
    beyond_deg: Floats
    """Distance beyond the limit; below 0 inside."""
    value_deg: Floats
    limit_deg: Floats
    upper: bool


class Nearest(NamedTuple):
    """The place of a motion that is nearest to a limit, or farthest beyond a limit."""

    margin_deg: float
    """Distance to the limit; below 0 beyond it."""
    row: int
    quantity: Text
    motor: int
    value_deg: float
    limit_deg: float
    upper: bool


def reachable_set(motors_deg: Floats, side: Side) -> list[Bound]:
    """Return every limit of the apparatus that applies to a pose.

    :param motors_deg: motor angles, shape ``(n, 5)``.
    """
    scapula = scapula_of(motors_deg, side)
    bounds = _scapula(scapula, (POSE_RANGE_DEG[0], POSE_RANGE_DEG[1]))
    bounds.append(_bound(texts.BALL_JOINT_SWING(), 2, scapula.swing_deg, BALL_JOINT_DEG))
    # The joint is on the scapula, and Table 2 counts from the scapula. The arm's angles here do not include the scapula's.
    flexion = np.radians(motors_deg[:, 3])
    arm = _arm(np.radians(motors_deg[:, 2]), flexion, np.zeros(len(flexion)))
    beyond = np.minimum(_beyond_plane(arm, CROSS_BODY_DEG), OVERHEAD_DEG - arm.elevation_deg)
    # Up to 90 deg of flexion the arm is in front of the body, or hangs behind it.
    beyond = np.where(np.cos(flexion) < 0.0, beyond, -90.0)
    bounds.append(_bound(texts.PLANE_OF_ELEVATION(), 4, arm.plane_deg, CROSS_BODY_DEG)._replace(beyond_deg=beyond))
    return bounds


def doctors_set(motors_deg: Floats, side: Side, limits: ArmLimits) -> list[Bound]:
    """Return every limit of a doctor that applies to a pose.

    :param motors_deg: motor angles, shape ``(n, 5)``.
    """
    scapula = scapula_of(motors_deg, side)
    lifted = np.radians(motors_deg[:, 2] + scapula.psi_deg)
    arm = _arm(lifted, np.radians(motors_deg[:, 3]), np.radians(scapula.phi_deg))
    around = np.where(arm.plane_deg > 180.0, arm.plane_deg - 360.0, arm.plane_deg)
    highest = np.interp(around, PLANES_DEG, limits.elevations_deg)
    fade = FADE * (
        np.maximum(RAISED_DEG[0] - arm.elevation_deg, 0.0) + np.maximum(arm.elevation_deg - RAISED_DEG[1], 0.0)
    )
    lowest_plane, highest_plane = limits.plane_deg[0] - fade, limits.plane_deg[1] + fade
    hanging, level = limits.flexion_from_deg
    from_deg = hanging + (level - hanging) * np.clip(motors_deg[:, 2] / 90.0, 0.0, 1.0)
    return [
        *_scapula(scapula, limits.scapula_deg),
        _bound(texts.ELEVATION_OF_ARM(), 4, arm.elevation_deg, highest),
        _bound(texts.PLANE_OF_ELEVATION(), 4, arm.plane_deg, highest_plane)._replace(
            beyond_deg=_beyond_plane(arm, highest_plane)
        ),
        _bound(texts.PLANE_OF_ELEVATION(), 4, around, lowest_plane, upper=False)._replace(
            beyond_deg=_arc(arm.elevation_deg, lowest_plane - around)
        ),
        _bound(texts.FLEXION_OF_MOTOR_4(), 4, motors_deg[:, 3], from_deg, upper=False),
    ]


def nearest(motors_deg: Floats, bounds: Callable[[Floats], list[Bound]]) -> Nearest:
    """Return the place where a motion is nearest to one of the limits, or farthest beyond it.

    :param motors_deg: motor angles, shape ``(n, 5)``, n at least 1.
    :param bounds: :func:`reachable_set` or :func:`doctors_set` with its other parameters.
    """
    candidates = []
    for first in range(0, len(motors_deg), _CHUNK):
        for bound in bounds(motors_deg[first : first + _CHUNK]):
            row = int(np.argmax(bound.beyond_deg))
            candidates.append(
                Nearest(
                    margin_deg=-float(bound.beyond_deg[row]),
                    row=first + row,
                    quantity=bound.quantity,
                    motor=bound.motor,
                    value_deg=float(bound.value_deg[row]),
                    limit_deg=float(bound.limit_deg[row]),
                    upper=bound.upper,
                )
            )
    return min(candidates, key=lambda place: place.margin_deg)


def setpoint_times(path: Trajectory) -> Floats:
    """Return the times ``(m,)`` at which a motion is checked. They are the times of setpoints at 100 Hz."""
    return np.append(np.arange(0.0, path.duration_s, _STEP_S), path.duration_s)


def check_poses_of(path: Trajectory, bounds: Callable[[Floats], list[Bound]], tolerance_deg: float) -> None:
    """Refuse a motion that is beyond a limit by more than the tolerance.

    :param bounds: as for :func:`nearest`.
    :raises TrajectoryError: naming motor, time, angle and limit of the worst violation.
    """
    times_s = setpoint_times(path)
    angles = path.along(times_s)
    worst = nearest(angles, bounds)
    # This comparison refuses NaN too.
    if not worst.margin_deg >= -tolerance_deg:
        at_s = float(times_s[worst.row])
        raise TrajectoryError(
            texts.POSE_OUT_OF_REACH(
                motor=worst.motor,
                angle_deg=angles[worst.row, worst.motor - 1],
                at_s=at_s,
                quantity=worst.quantity,
                value_deg=worst.value_deg,
                limit_deg=worst.limit_deg,
            ),
            worst.motor,
            at_s,
        )


class _Arm(NamedTuple):
    elevation_deg: Floats
    plane_deg: Floats
    """Plane of elevation, -90 to 270 deg."""


def _arm(lifted: Floats, flexion: Floats, turned: Floats) -> _Arm:
    """Return elevation and plane for the angles of motors 3 and 4 and the scapula's yaw, in radians; see
    :func:`kata.motion.shoulder.humerus_direction`.
    """
    forward, outward = np.sin(flexion), np.cos(flexion) * np.sin(lifted)
    elevation = np.degrees(np.arccos(np.cos(flexion) * np.cos(lifted)))
    plane = np.degrees(np.arctan2(forward, outward) + turned)
    return _Arm(elevation, (plane + 90.0) % 360.0 - 90.0)


def _arc(elevation_deg: Floats, planes_deg: Floats) -> Floats:
    """Return the angle in deg that the arm itself must move to change its plane by ``planes_deg``."""
    turn = np.sin(np.radians(elevation_deg)) * np.sin(np.radians(np.clip(planes_deg, -90.0, 90.0)))
    arc: Floats = np.degrees(np.arcsin(np.clip(turn, -1.0, 1.0)))
    return arc


def _beyond_plane(arm: _Arm, highest_deg: Floats | float) -> Floats:
    return _arc(arm.elevation_deg, arm.plane_deg - highest_deg)


def _scapula(scapula: Scapula, ranges: tuple[tuple[float, float], tuple[float, float]]) -> list[Bound]:
    bounds = []
    names = texts.SCAPULA_ABDUCTION(), texts.SCAPULA_ROTATION()
    angles = scapula.phi_deg, scapula.psi_deg
    for motor, (name, values, (low, high)) in enumerate(zip(names, angles, ranges, strict=True), start=1):
        bounds.append(_bound(name, motor, values, low, upper=False))
        bounds.append(_bound(name, motor, values, high))
    return bounds


def _bound(quantity: Text, motor: int, values: Floats, limit: Floats | float, *, upper: bool = True) -> Bound:
    limits = np.broadcast_to(np.asarray(limit, dtype=np.float64), values.shape)
    return Bound(quantity, motor, values - limits if upper else limits - values, values, limits, upper)
