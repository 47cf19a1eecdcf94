"""Check a planned motion against a doctor's limits.

The limits apply to the body's angles, and a doctor names them by motion. They limit the pose of the arm, independent of the motion that leads to it:

* motion 4 (abduction) and motion 5 (flexion) limit the **elevation** of the upper arm, sideways and forward; directions in between are
interpolated;
* motion 3 (horizontal flexion) limits the **plane** of the raised arm, independent of the motors that raised it;
* the lowest angle of motion 5 (extension), and that of motion 3 with the level arm, limit motor 4 backward.

Limits that were stored when each motion had its own motor have the same meaning now. Everything that they forbade then is still forbidden:
the angle of motion 5 up to 45 deg of abduction, and that of motion 3 beyond 45 deg.

The device receives the limits of single motors and of the pose, and lets no setpoint exceed them.
"""

import math
from dataclasses import dataclass
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.episodes import service
from kata.clinic.episodes.schemas import MotionLimit
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.errors import ProblemError
from kata.messages import Text
from kata.motion.axes import AXES, BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.linkage import Floats, OutOfReachError, pose_deg
from kata.motion.method import Method, reference
from kata.motion.reach import (
    FREE_DEG,
    LEVEL_BACK_DEG,
    POSE_ROUNDING_DEG,
    ArmLimits,
    doctors_set,
    nearest,
    setpoint_times,
)
from kata.motion.shoulder import motion_of_motor_4
from kata.motion.texts import SIDES
from kata.motion.trajectory import Trajectory
from kata.types import side_of

MotorLimits = tuple[tuple[float, float], ...]
"""Lowest and highest angle of each motor, or empty (:attr:`kata.device.ipc_messages.Load.limits_deg`)."""

_FREE_DEG: Final = (-FREE_DEG, FREE_DEG)
"""Means "no limit": no motor can reach these angles."""
_WHOLE_ELEVATION_DEG: Final = 180.0
"""Highest elevation of an arm, in degrees."""
_SCAPULA: Final = (1, 2)
_MOTOR_4: Final = (3, 5)


@dataclass(frozen=True)
class DoctorLimits:
    """A doctor's limits for one shoulder."""

    side: Side
    by: str
    """Name of the doctor who set the limits."""
    max_resistance_level: int | None
    max_speed_deg_s: float | None
    """Highest speed of every motor (:attr:`kata.device.ipc_messages.Load.max_speed_deg_s`)."""
    motions: tuple[MotionLimit, ...]
    self_paced_permitted: bool = False

    def check_self_paced(self, *, self_paced: bool) -> None:
        """Refuse a self-paced run without the doctor's permission.

        :raises ProblemError: 422.
        """
        if self_paced and not self.self_paced_permitted:
            raise ProblemError(
                422, "self_pace_not_permitted", texts.SELF_PACE_NOT_PERMITTED(), texts.ASK_DOCTOR_OR_OWN_PACE()
            )

    def check(self, motion: Motion, resistance_level: int, method: Method) -> MotorLimits:
        """Refuse a run that exceeds the limits. This needs no database, and takes seconds for a motion of an hour.

        :param motion: motor angles that the run requests.
        :returns: the limits of single motors; the device also gets :attr:`arm`.
        :raises ProblemError: 422 when a limit is exceeded. The message names motion or motor, time, and both angles or speeds.
        """
        if self.max_resistance_level is not None and resistance_level > self.max_resistance_level:
            raise ProblemError(
                422,
                "level_not_allowed",
                texts.RESISTANCE_LEVEL_ABOVE_LIMIT(
                    level=resistance_level, highest=self.max_resistance_level, doctor=self.by
                ),
                texts.CHOOSE_RESISTANCE_LEVEL(highest=self.max_resistance_level),
            )
        self.check_path(motion, method)
        return _of_motors(self._by_motion)

    def check_path(self, motion: Motion, method: Method) -> None:
        """Check only angles and speeds, for an item of a programme. Its resistance level is checked separately, without samples.

        :raises ProblemError: 422 when a limit is exceeded. The message names motion or motor, time, and both angles or speeds.
        """
        if not self.motions and self.max_speed_deg_s is None:
            return
        path = reference(method, motion.times_s, motion.angles_deg)
        if self.max_speed_deg_s is not None:
            _check_speed(path, self.max_speed_deg_s, self.by)
        if self.motions:
            _check_path(self._by_motion, self.side, path, self.by)
        if self.arm:
            _check_arm(self.arm, self.side, path, self.by)

    @property
    def arm(self) -> ArmLimits | None:
        """Limits of the pose; None if there are none."""
        limits = self._by_motion
        if not any(motion in limits for motion in (1, 2, 3, 4, 5)):
            return None
        side_deg, front_deg = (_highest(limits, motion, _WHOLE_ELEVATION_DEG) for motion in (4, 5))
        hanging_deg = _lowest(limits, 5)
        return ArmLimits(
            scapula_deg=(_range(limits, 1), _range(limits, 2)),
            side_deg=side_deg,
            front_deg=front_deg,
            # Behind the body the arm may go as far as sideways, and at least as far as the apparatus extends the shoulder.
            back_deg=max(side_deg, BASIC_MOTIONS[4].range_deg[0] * -1.0),
            plane_deg=_range(limits, 3),
            flexion_from_deg=(
                hanging_deg,
                hanging_deg if hanging_deg == -FREE_DEG else max(_lowest(limits, 3), LEVEL_BACK_DEG),
            ),
        )

    @property
    def _by_motion(self) -> dict[int, MotionLimit]:
        return {limit.motion: limit for limit in self.motions}


def allowed(session: Session, patient_id: UUID, side: Side) -> DoctorLimits:
    """Return the doctor's limits for this shoulder.

    :raises ProblemError: 409 when this shoulder has no open episode.
    """
    episode = service.open_episode(session, patient_id, side)
    if episode is None:
        name = patients.get(session, patient_id).name
        raise ProblemError(
            409,
            "no_open_episode",
            texts.NO_OPEN_CARE_OF_SHOULDER(side=SIDES[side], patient=name),
            texts.OPEN_EPISODE_FIRST(),
        )
    return of_episode(episode)


def of_episode(episode: EpisodeRow) -> DoctorLimits:
    """Return the doctor's limits for the shoulder of this episode."""
    motions = tuple(map(MotionLimit.model_validate, episode.limits))
    return DoctorLimits(
        side=side_of(episode.side),
        by=episode.limits_by,
        max_resistance_level=episode.max_resistance_level,
        max_speed_deg_s=episode.max_speed_deg_s,
        motions=motions,
        self_paced_permitted=episode.self_paced_permitted,
    )


def _check_speed(path: Trajectory, limit_deg_s: float, doctor: str) -> None:
    times_s, speeds_deg_s = path.speeds()
    at, axis = np.unravel_index(int(np.argmax(speeds_deg_s)), speeds_deg_s.shape)
    fastest = speeds_deg_s[at, axis]
    if fastest > limit_deg_s:
        raise ProblemError(
            422,
            "too_fast_for_doctor",
            # Rounded up, so that a refused speed does not look like an allowed one.
            texts.MOTOR_FASTER_THAN_ALLOWED(
                motor=axis + 1,
                speed_deg_s=math.ceil(fastest * 10) / 10,
                at_s=times_s[at],
                doctor=doctor,
                limit_deg_s=limit_deg_s,
            ),
            texts.CHOOSE_LOWER_SPEED(),
        )


def _check_path(limits: dict[int, MotionLimit], side: Side, path: Trajectory, doctor: str) -> None:
    times_s = setpoint_times(path)
    angles = path.along(times_s)
    if any(number in limits for number in _SCAPULA):
        angles = _body(angles, side)
    by_motor_4 = motion_of_motor_4(angles[:, 2])
    for number, limit in sorted(limits.items()):
        basic = BASIC_MOTIONS[number - 1]
        is_made = by_motor_4 == number if number in _MOTOR_4 else np.full(len(times_s), True)
        lowest = -math.inf if limit.lowest_deg is None else limit.lowest_deg
        highest = math.inf if limit.highest_deg is None else limit.highest_deg
        angle = angles[:, basic.axis - 1]
        beyond = np.where(is_made, np.maximum(lowest - angle, angle - highest), -math.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 0:
            over = angle[worst] > highest
            # Rounded away from the limit, so that a refused angle does not look like an allowed one.
            rounded_deg = (math.ceil if over else math.floor)(angle[worst] * 10) / 10
            name = Text(basic.name.lower(), basic.name.key)
            beyond_limit = {
                "number": number, "motion": name, "angle_deg": rounded_deg, "at_s": times_s[worst], "doctor": doctor
            }  # fmt: skip
            raise ProblemError(
                422,
                "beyond_doctors_limit",
                texts.MOTION_BEYOND_HIGHEST(**beyond_limit, highest_deg=highest)
                if over
                else texts.MOTION_BELOW_LOWEST(**beyond_limit, lowest_deg=lowest),
                texts.CHOOSE_LESS_RANGE(),
            )


def _check_arm(arm: ArmLimits, side: Side, path: Trajectory, doctor: str) -> None:
    times_s = setpoint_times(path)
    worst = nearest(path.along(times_s), lambda motors_deg: doctors_set(motors_deg, side, arm))
    if worst.margin_deg >= -POSE_ROUNDING_DEG:
        return
    # Rounded away from the limit, so that a refused angle does not look like an allowed one.
    rounded_deg = (math.ceil if worst.upper else math.floor)(worst.value_deg * 10) / 10
    beyond_limit = {
        "quantity": worst.quantity, "angle_deg": rounded_deg, "at_s": times_s[worst.row], "doctor": doctor
    }  # fmt: skip
    raise ProblemError(
        422,
        "beyond_doctors_limit",
        texts.ARM_BEYOND_HIGHEST(**beyond_limit, highest_deg=worst.limit_deg)
        if worst.upper
        else texts.ARM_BELOW_LOWEST(**beyond_limit, lowest_deg=worst.limit_deg),
        texts.CHOOSE_LESS_RANGE(),
    )


def _range(limits: dict[int, MotionLimit], motion: int) -> tuple[float, float]:
    return _lowest(limits, motion), _highest(limits, motion, FREE_DEG)


def _lowest(limits: dict[int, MotionLimit], motion: int) -> float:
    lowest_deg = limits[motion].lowest_deg if motion in limits else None
    return -FREE_DEG if lowest_deg is None else lowest_deg


def _highest(limits: dict[int, MotionLimit], motion: int, free_deg: float) -> float:
    highest_deg = limits[motion].highest_deg if motion in limits else None
    return free_deg if highest_deg is None else highest_deg


def _body(motors_deg: Floats, side: Side) -> Floats:
    try:
        return pose_deg(motors_deg, side)
    except OutOfReachError as error:
        raise ProblemError(
            422,
            "scapula_unknown",
            texts.SCAPULA_UNKNOWN(),
            texts.TEACH_AGAIN(),
        ) from error


def _of_motors(limits: dict[int, MotionLimit]) -> MotorLimits:
    """Return the limits per motor. Motor 4 gets only the limits that neither of its two motions may exceed."""
    if not any(motion in limits for motion in (3, 4, 5, 6)):
        return ()
    return tuple(_of_motor(motor, limits) for motor in AXES)


def _of_motor(motor: int, limits: dict[int, MotionLimit]) -> tuple[float, float]:
    motions = [basic.number for basic in BASIC_MOTIONS if basic.motors == (motor,)]
    known_limits = [limits[number] for number in motions if number in limits]
    if not motions or len(known_limits) < len(motions):
        return _FREE_DEG
    lowest = [limit.lowest_deg for limit in known_limits if limit.lowest_deg is not None]
    highest = [limit.highest_deg for limit in known_limits if limit.highest_deg is not None]
    return (
        min(lowest) if len(lowest) == len(motions) else _FREE_DEG[0],
        max(highest) if len(highest) == len(motions) else _FREE_DEG[1],
    )
