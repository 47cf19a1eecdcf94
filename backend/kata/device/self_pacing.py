"""Implements self-paced assistance: the patient's effort sets the pace along a recording. Reasons: docs/explanation/self-paced.md.

The pace is never above the recording's own speed and never backwards. All supervision of a playback applies.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.device.config import StationConfig
from kata.device.config_rules import REVERSAL_RAMP_S
from kata.device.cycle_state import CycleState
from kata.device.ipc_messages import SelfPacingState
from kata.device.movement import Movement
from kata.device.resistance import SLOW_DEG_S
from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.trajectory import Trajectory

TIME_CONSTANT_S: Final = 0.25
"""Virtual mass divided by virtual damping. It makes the pace rise and fall smoothly."""
STIFFNESS_NM_RAD: Final = 25.0
"""Stiffness of arm, cuff and drive together with which the loop keeps a gain margin of 2. It is our assumption."""
_GAIN_MARGIN: Final = 2.0
_LEAST_LAG_S: Final = 0.1
"""A drive follows its setpoint up to this much later, also if its identified lag is shorter."""
_MODEL_ERROR_NM: Final = 0.5
"""Effort that does not move the arm: the error of the expected torque. Friction of the drives is added."""
_STEADY_S: Final = 0.5
"""Only effort that lasts counts: the smaller one of the present effort and its mean over this time. A tremor of 4 to 12 Hz has almost no mean."""
_AHEAD_S: Final = 0.3
"""The direction of the path is that of the next part of the recording."""
_RESTING_DEG: Final = 0.3
"""The recording rests if it moves by less than this within :data:`_AHEAD_S`."""
NEAR_END_DEG: Final = 10.0
"""Distance from the end of a motion, and from a limit, at which the pace may only fall. It equals the band of the end-range time."""
SLOW_SHARE: Final = 0.2
"""Near an end the pace may rise to this share of the recording's speed at most. Without it a patient who rests there could never complete
the motion."""
_LEAST_PART: Final = 0.1
"""A motor whose part of the movement is smaller has no end."""


def least_damping_nm_s(delay_s: float, stiffness_nm_rad: float = STIFFNESS_NM_RAD) -> float:
    """Return the least virtual damping in Nm s/rad with which the loop is stable with the gain margin.

    The open loop is ``K / D * exp(-s T) / (s (1 + s TIME_CONSTANT_S))``: the arm's movement reduces the effort by the stiffness ``K``, and the
    apparatus answers after the delay ``T``. Its phase is -180 degrees at the frequency that the bisection finds.
    """
    low, high = 0.0, math.pi / 2 / delay_s
    for _ in range(50):
        middle = (low + high) / 2
        below = math.atan(middle * TIME_CONSTANT_S) + middle * delay_s < math.pi / 2
        low, high = (middle, high) if below else (low, middle)
    return _GAIN_MARGIN * stiffness_nm_rad / (low * math.hypot(1.0, low * TIME_CONSTANT_S))


class PaceController:
    """Admittance with virtual mass and damping: turns the patient's effort into a speed along the path.

    It gives no energy: whatever the efforts are, the patient's work is at least the change of the virtual mass's kinetic energy. Each rule that
    changes its input or output reduces them, which keeps this property.
    """

    def __init__(self, damping_nm_s: float, step_s: float) -> None:
        """Start at rest. ``damping_nm_s``: virtual damping in Nm s/rad. ``step_s``: time between two updates."""
        self.mass_nm_s2 = TIME_CONSTANT_S * damping_nm_s
        """Virtual mass in Nm s2/rad."""
        self._damping_nm_s = damping_nm_s
        self._step_s = step_s
        self._recent: deque[float] = deque([0.0] * round(_STEADY_S / step_s), maxlen=round(_STEADY_S / step_s))
        self.speed_rad_s = 0.0
        """Present speed along the path."""

    @property
    def mean_effort_nm(self) -> float:
        """Mean effort over the last half second."""
        return sum(self._recent) / len(self._recent)

    def rest(self) -> None:
        """Start again from rest. Earlier effort does not count."""
        self.speed_rad_s = 0.0
        self._recent.extend([0.0] * len(self._recent))

    def update(self, effort_nm: float, threshold_nm: float, top_rad_s: float, *, near_end: bool) -> float:
        """Return the speed along the path in rad/s for one step, from 0 to ``top_rad_s``.

        :param effort_nm: torque of the patient along the path, forwards.
        :param threshold_nm: effort that does not move the arm.
        :param top_rad_s: the recording's own speed.
        :param near_end: True near an end or limit towards which the arm moves.
        """
        self._recent.append(effort_nm)
        pushes_nm = min(effort_nm, self.mean_effort_nm) - threshold_nm
        gain = self._step_s / self.mass_nm_s2
        speed = (self.speed_rad_s + gain * pushes_nm) / (1.0 + gain * self._damping_nm_s)
        if near_end:
            top_rad_s = min(top_rad_s, max(self.speed_rad_s, SLOW_SHARE * top_rad_s))
        self.speed_rad_s = min(max(speed, 0.0), top_rad_s)
        return self.speed_rad_s


@dataclass(frozen=True)
class _Way:
    """The next part of the recording with the present range: ``direction`` is a unit vector ``(5,)``, ``top_rad_s`` the recording's speed."""

    direction: Floats
    top_rad_s: float


class SelfPacing:
    """Sets the pace of one run, and adds up the patient's effort and work."""

    def __init__(self, trajectory: Trajectory, config: StationConfig) -> None:
        self._trajectory = trajectory
        self._load = config.servo_model.load
        self._step_s = 1.0 / config.rate_hz
        self._cycles_between_steps = config.cycle_hz // config.rate_hz
        self._cycles = 0
        lag_s = max(float(np.max(config.servo_model.first_s)), _LEAST_LAG_S)
        delay_s = 2.0 / config.cycle_hz + 1.5 * self._step_s + config.setpoint_delay_s + lag_s
        self._controller = PaceController(least_damping_nm_s(delay_s), self._step_s)
        self._pace = self._threshold_nm = 0.0
        self._direction: list[float] | None = None
        """Direction of the path while the arm is played forwards."""
        self._effort_sum_nm, self._moving_steps = 0.0, 0
        self._pace_sum, self._paced_steps = 0.0, 0
        self.work_j = 0.0
        """Work of the patient along the path; less than 0 if the patient resists more than helps."""

    @property
    def mean_effort_nm(self) -> float | None:
        """Mean effort while the patient moved the arm; None if it has not moved."""
        return self._effort_sum_nm / self._moving_steps if self._moving_steps else None

    @property
    def mean_pace_percent(self) -> float | None:
        """Mean pace while the recording was played and moved, percent of its speed; None if it was not. Waiting for the patient counts as
        0.
        """
        return 100.0 * self._pace_sum / self._paced_steps if self._paced_steps else None

    def state(self) -> SelfPacingState:
        """Return effort, pace and work for the snapshot."""
        return SelfPacingState(
            pace_percent=100.0 * self._pace,
            effort_nm=self._controller.mean_effort_nm,
            threshold_nm=self._threshold_nm,
            work_j=self.work_j,
        )

    def rest(self) -> None:
        """Let the next pace start from rest, after a pause or a reversal."""
        self._controller.rest()
        self._pace = 0.0
        self._direction = None

    def resisted_deg_s(self, speed_deg_s: list[float]) -> list[float]:
        """Return the speeds by which resistance is detected. A motor that waits for the patient counts as moving along the path: a push forwards
        is effort, and only a push backwards is resistance.
        """
        if self._direction is None:
            return speed_deg_s
        return [
            math.copysign(SLOW_DEG_S, part) if abs(speed) < SLOW_DEG_S and abs(part) >= _LEAST_PART else speed
            for speed, part in zip(speed_deg_s, self._direction, strict=True)
        ]

    def set_pace(self, movement: Movement, state: CycleState, share: float, limits_deg: tuple[Floats, Floats]) -> None:
        """Set the speed override by the patient's effort, as often as setpoints are sent. Call it in every cycle in which the recording is played.

        :param share: present share of the recording's range.
        :param limits_deg: lowest and highest setpoints, ``(5,)`` each.
        """
        if movement.direction != 1:
            self.rest()
            return
        self._cycles += 1
        if self._cycles % self._cycles_between_steps:
            return
        movement.ramp_s = REVERSAL_RAMP_S
        way = self._way(movement.position_s, share)
        self._direction = None if way is None else way.direction.tolist()
        if way is None:
            # The arm does not move, so the recording's clock passes a rest at its own speed.
            self._controller.rest()
            self._pace = movement.top_override = 1.0
            return
        effort_nm, self._threshold_nm = self._effort_nm(way, movement, state, share)
        near_end = self._near_end(way, np.array(state.setpoint_deg), share, limits_deg)
        speed = self._controller.update(effort_nm, self._threshold_nm, way.top_rad_s, near_end=near_end)
        self._pace = movement.top_override = speed / way.top_rad_s
        self._pace_sum += movement.speed_override
        self._paced_steps += 1
        if movement.speed_override > 0.0:
            self.work_j += effort_nm * movement.speed_override * way.top_rad_s * self._step_s
            self._effort_sum_nm += effort_nm
            self._moving_steps += 1

    def _way(self, position_s: float, share: float) -> _Way | None:
        """Return the next part of the recording; None if the recording rests there."""
        until_s = min(position_s + _AHEAD_S, self._trajectory.duration_s)
        since_s = max(until_s - _AHEAD_S, 0.0)
        change_deg = share * (self._trajectory.at(until_s) - self._trajectory.at(since_s))
        length_deg = float(np.linalg.norm(change_deg))
        if length_deg < _RESTING_DEG:
            return None
        return _Way(change_deg / length_deg, math.radians(length_deg) / (until_s - since_s))

    def _effort_nm(self, way: _Way, movement: Movement, state: CycleState, share: float) -> tuple[float, float]:
        """Return the patient's effort along the path and the effort that does not move the arm.

        The torque at the shoulder is the drive's torque minus the identified load's, as for the end-range time.
        """
        _, speed, acceleration = movement.motion(0.0)
        motion = PathPoint(np.array(state.measured_deg), share * speed, share * acceleration)
        helps_nm = (self._load.torque_nm(motion) - np.array(state.torque_nm)) / self._load.share
        friction_nm = float(np.abs(way.direction) @ self._load.coulomb_nm)
        return float(way.direction @ helps_nm), _MODEL_ERROR_NM + friction_nm

    def _near_end(self, way: _Way, angles_deg: Floats, share: float, limits_deg: tuple[Floats, Floats]) -> bool:
        """Return True if a motor approaches the end of its motion that is farthest from rest, or a limit."""
        moves = np.abs(way.direction) >= _LEAST_PART
        from_rest_deg = angles_deg - self._trajectory.rest_deg
        farthest_deg = share * self._trajectory.farthest_deg
        has_end = (farthest_deg >= 2 * NEAR_END_DEG) & (way.direction * from_rest_deg > 0.0)
        ends = has_end & (farthest_deg - np.abs(from_rest_deg) < NEAR_END_DEG)
        lowest_deg, highest_deg = limits_deg
        left_deg = np.where(way.direction > 0.0, highest_deg - angles_deg, angles_deg - lowest_deg)
        return bool(np.any(moves & (ends | (left_deg < NEAR_END_DEG))))
