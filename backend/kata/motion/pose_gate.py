"""Checks one setpoint against the reachable set and a doctor's limits, as :mod:`kata.motion.reach`, but within a control cycle."""

import math
from collections.abc import Sequence
from typing import Final

from kata.motion.axes import APPARATUS_SIGNS, POSE_RANGE_DEG, Side
from kata.motion.reach import CROSS_BODY_DEG, FADE, OVERHEAD_DEG, PLANES_DEG, RAISED_DEG, ArmLimits
from kata.motion.scapula_fit import BALL_JOINT_DEG, scapula_at

_STEPS: Final = 8
"""Maximum number of steps towards the limit. Two are enough unless two limits meet."""
_NUDGE_DEG: Final = 0.01
_INSIDE_DEG: Final = 0.002
"""Distance inside the limit at which a step aims, so that the last step ends inside."""
_COUPLED: Final = 4
"""Number of motors (1 to 4) that determine the limited pose. Motor 5 turns the arm about its own axis."""


class PoseGate:
    """Calculates how far a pose is beyond the limits, and moves a setpoint to the inside of the limits."""

    def __init__(self, side: Side, limits: ArmLimits | None, tolerance_deg: float) -> None:
        """Set the limits. ``tolerance_deg``: distance that a setpoint may leave the reachable set. A doctor's limits have no tolerance."""
        self._signs = APPARATUS_SIGNS[side]
        self._limits = limits
        self._tolerance_deg = tolerance_deg
        self._last_deg: tuple[float, ...] = ()
        """The first four angles of the last pose. A cycle asks for the same pose up to three times."""
        self._last_beyond_deg = 0.0

    def beyond_deg(self, motors_deg: Sequence[float]) -> float:
        """Return the distance in deg by which the pose is beyond the limits; 0 or less inside. This takes some microseconds.

        :param motors_deg: five finite motor angles.
        """
        coupled_deg = tuple(motors_deg[:_COUPLED])
        if coupled_deg != self._last_deg:
            self._last_beyond_deg = self._computed_beyond_deg(motors_deg)
            self._last_deg = coupled_deg
        return self._last_beyond_deg

    def _computed_beyond_deg(self, motors_deg: Sequence[float]) -> float:
        phi, psi, cosine = scapula_at(motors_deg[0], motors_deg[1])
        phi *= self._signs[0]
        psi *= self._signs[1]
        reach = self._beyond_reach(phi, psi, cosine, motors_deg) - self._tolerance_deg
        return reach if self._limits is None else max(reach, self._beyond_doctors(self._limits, phi, psi, motors_deg))

    def held(
        self,
        motors_deg: list[float],
        level_deg: float,
        lowest_deg: list[float],
        highest_deg: list[float],
    ) -> list[float]:
        """Return the setpoint, or the nearest one that is beyond the limits by at most ``level_deg``.

        The setpoint moves back in the steepest direction, so that a setpoint at a limit slides along the limit without a jump.

        :param lowest_deg: lowest angle of each motor; ``highest_deg``: highest angle.
        """
        pose = motors_deg
        for _ in range(_STEPS):
            beyond = self.beyond_deg(pose) - level_deg
            if beyond <= 0.0:
                return pose
            slopes = [
                (self.beyond_deg([*pose[:n], pose[n] + _NUDGE_DEG, *pose[n + 1 :]]) - level_deg - beyond) / _NUDGE_DEG
                for n in range(_COUPLED)
            ]
            steepness = sum(slope * slope for slope in slopes)
            if steepness < _INSIDE_DEG:
                return pose
            distance_deg = (beyond + _INSIDE_DEG) / steepness
            moved = (
                min(max(angle - distance_deg * slope, low), high)
                for angle, slope, low, high in zip(pose[:_COUPLED], slopes, lowest_deg, highest_deg, strict=False)
            )
            pose = [*moved, *pose[_COUPLED:]]
        return pose

    def _beyond_reach(self, phi: float, psi: float, cosine: float, motors_deg: Sequence[float]) -> float:
        (lowest_phi, highest_phi), (lowest_psi, highest_psi) = POSE_RANGE_DEG[:2]
        beyond = max(lowest_phi - phi, phi - highest_phi, lowest_psi - psi, psi - highest_psi)
        beyond = max(beyond, math.degrees(math.acos(min(max(cosine, -1.0), 1.0))) - BALL_JOINT_DEG)
        flexion = math.radians(motors_deg[3])
        if math.cos(flexion) >= 0.0:
            return beyond
        elevation, plane = _arm(math.radians(motors_deg[2]), flexion, 0.0)
        return max(beyond, min(_arc(elevation, plane - CROSS_BODY_DEG), OVERHEAD_DEG - elevation))

    @staticmethod
    def _beyond_doctors(limits: ArmLimits, phi: float, psi: float, motors_deg: Sequence[float]) -> float:
        elevation, plane = _arm(math.radians(motors_deg[2] + psi), math.radians(motors_deg[3]), math.radians(phi))
        around = plane - 360.0 if plane > 180.0 else plane
        fade = FADE * (max(RAISED_DEG[0] - elevation, 0.0) + max(elevation - RAISED_DEG[1], 0.0))
        (lowest_phi, highest_phi), (lowest_psi, highest_psi) = limits.scapula_deg
        hanging, level = limits.flexion_from_deg
        from_deg = hanging + (level - hanging) * min(max(motors_deg[2] / 90.0, 0.0), 1.0)
        return max(
            lowest_phi - phi,
            phi - highest_phi,
            lowest_psi - psi,
            psi - highest_psi,
            elevation - _highest_elevation(limits, around),
            _arc(elevation, plane - limits.plane_deg[1] - fade),
            _arc(elevation, limits.plane_deg[0] - fade - around),
            from_deg - motors_deg[3],
        )


def _arm(lifted: float, flexion: float, turned: float) -> tuple[float, float]:
    """Return elevation and plane of elevation, -90 to 270, in degrees."""
    outward = math.cos(flexion) * math.sin(lifted)
    cosine = math.cos(flexion) * math.cos(lifted)
    plane = math.degrees(math.atan2(math.sin(flexion), outward) + turned)
    return math.degrees(math.acos(cosine)), (plane + 90.0) % 360.0 - 90.0


def _arc(elevation_deg: float, plane_deg: float) -> float:
    turn = math.radians(min(max(plane_deg, -90.0), 90.0))
    return math.degrees(math.asin(math.sin(math.radians(elevation_deg)) * math.sin(turn)))


def _highest_elevation(limits: ArmLimits, plane_deg: float) -> float:
    """Interpolate :attr:`ArmLimits.elevations_deg`."""
    piece = min(int((plane_deg - PLANES_DEG[0]) // 90.0), len(PLANES_DEG) - 2)
    low, high = limits.elevations_deg[piece : piece + 2]
    return low + (high - low) * (plane_deg - PLANES_DEG[piece]) / 90.0
