"""Moves the motor of an X-series servo as its registers say: gains, goals, profile and operating mode (ROBOTIS e-Manual).

Scale factors convert the gains in the table to torque. They are chosen so that the registers' steps are fine enough for the
gains in :mod:`~kata.simulator.parameters`. The modes for current and PWM need the simple plant.
"""

import math
import struct
from typing import Final

from kata.simulator import control_table as ct
from kata.simulator.drive import Drive
from kata.simulator.motors import CONTROL_PERIOD_S, FULL_PWM
from kata.simulator.parameters import NM_AN_AMPERE, RESISTANCE_OHM, SUPPLY_V
from kata.simulator.profile import Profile

P_NM_RAD: Final = 0.10
I_NM_RAD_S: Final = 0.50
D_NM_S_RAD: Final = 0.01
"""Torque per rad, per rad s and per rad/s of one unit in the registers of the position gains."""
_FEED_NM_S_RAD: Final = 4 * D_NM_S_RAD
"""Feed-forward 1st gain. The manual divides D by 16 and this gain by 4, so that we assume the same unit of speed for both."""
_FEED_NM_S2_RAD: Final = _FEED_NM_S_RAD * CONTROL_PERIOD_S
"""Feed-forward 2nd gain, also divided by 4, on the change of the speed in a control period."""
_VELOCITY_P_NM_S_RAD: Final = 0.015
_VELOCITY_I_NM_RAD: Final = 0.00625
_VELOCITY_INTEGRAL_HZ: Final = 5.0
"""Gains of the velocity control, with which each of the five motors is stable. The integral compensates friction."""
_STALL_NM_A_PWM: Final = SUPPLY_V / RESISTANCE_OHM * NM_AN_AMPERE / FULL_PWM

RAD_S_A_UNIT: Final = 0.229 * math.tau / 60
_RAD_S2_A_UNIT: Final = 214.577 * math.tau / 3600
_NO_VELOCITY: Final = bytes(4)
_PROFILES: Final = {"step": 0x00, "rectangular": 0x10, "triangular": 0x20, "trapezoidal": 0x30}
_PROFILE_ONGOING: Final = 0x02
"""Bits of Moving Status."""
_SETS_MOTION: Final = frozenset(
    (ct.OPERATING_MODE, ct.TORQUE_ENABLE, *ct.GOAL_BYTES, *range(ct.PROFILE, ct.PROFILE + 4))
)
"""Registers that change the movement in the modes without a goal position."""
_GOALS_WITH_DEFAULT: Final = frozenset((ct.GOAL_PWM, ct.GOAL_CURRENT))


class ServoMotion:
    """Applies a servo's registers to its drive."""

    def __init__(self, drive: Drive, table: bytearray) -> None:
        self._drive = drive
        self._table = table
        self._given_goals: set[int] = set()
        """Addresses of the goals that were written since the servo reset them."""
        self._tuned: tuple[object, ...] = ()
        """Registers and factors from which the drive's gains and torque limit were set."""

    @property
    def trajectory_velocity(self) -> int:
        """Velocity of the trajectory in the register's unit, in the direction of the shaft."""
        profile = self._drive.profile
        return round(profile.speed / RAD_S_A_UNIT) if profile else 0

    def status(self, *, in_position: bool) -> int:
        """Return Moving Status. Its bit for a following error is not simulated."""
        if not self._drive.torque_on or self._table[ct.OPERATING_MODE] not in ct.POSITION_MODES:
            return 0
        profile = self._drive.profile
        ongoing = _PROFILE_ONGOING | _PROFILES[profile.shape] if profile and profile.moves else 0
        return int(in_position) | ongoing

    def tune(self, gain_share: float, nm_a_unit: float) -> None:
        """Set the drive's gains and torque limit."""
        table = self._table
        (limit,), (pwm, current) = (
            struct.unpack_from("<H", table, ct.CURRENT_LIMIT),
            struct.unpack_from("<hh", table, ct.GOAL_PWM),
        )
        mode = table[ct.OPERATING_MODE]
        tuned = (table[ct.VELOCITY_GAINS : ct.FEEDFORWARD + 4], limit, pwm, current, mode, gain_share, nm_a_unit)
        if tuned == self._tuned:
            return
        self._tuned = tuned
        if mode == ct.CURRENT_BASED_POSITION:
            limit = min(limit, abs(current))
        limit_nm = limit * nm_a_unit
        if mode != ct.PWM:
            # Goal PWM limits the voltage, and thereby the torque at standstill.
            limit_nm = min(limit_nm, abs(pwm) * _STALL_NM_A_PWM)
        self._drive.tune(*self._gains(mode, gain_share), limit_nm)
        second, first = struct.unpack_from("<HH", table, ct.FEEDFORWARD) if mode in ct.POSITION_MODES else (0, 0)
        self._drive.feed_forward(first * _FEED_NM_S_RAD, second * _FEED_NM_S2_RAD)

    def _gains(self, mode: int, share: float) -> tuple[float, float, float]:
        """Return P, I and D of the angle's control in Nm/rad, Nm/(rad s) and Nm s/rad. They are 0 if the mode controls no angle."""
        velocity_i, velocity_p, d, i, p = struct.unpack_from("<5H", self._table, ct.VELOCITY_GAINS)
        if mode in ct.POSITION_MODES:
            return p * share * P_NM_RAD, i * share * I_NM_RAD_S, d * D_NM_S_RAD
        if mode != ct.VELOCITY:
            return 0.0, 0.0, 0.0
        stiffness = velocity_i * _VELOCITY_I_NM_RAD
        return stiffness, stiffness * _VELOCITY_INTEGRAL_HZ, velocity_p * _VELOCITY_P_NM_S_RAD

    def aim(self, goal: float) -> None:
        """Approach a goal (rad) with the profile in the registers. Modes without a goal position ignore it."""
        table, drive = self._table, self._drive
        if table[ct.OPERATING_MODE] not in ct.POSITION_MODES:
            return
        begin = drive.followed_goal
        drive.set_goal(goal)
        if table[ct.PROFILE + 4 : ct.PROFILE + 8] == _NO_VELOCITY:
            drive.profile = None
            return
        if drive.profile is None:
            drive.profile = Profile()
            drive.profile.stop(begin)
        acceleration, velocity = struct.unpack_from("<II", table, ct.PROFILE)
        if table[ct.DRIVE_MODE] & ct.TIME_BASED:
            drive.profile.follow_in_time(goal, velocity / 1000, acceleration / 1000)
        else:
            drive.profile.follow(goal, velocity * RAD_S_A_UNIT, acceleration * _RAD_S2_A_UNIT)

    def drive_without_goal(self, touched: range, sign: int, nm_a_unit: float) -> None:
        """Apply goal velocity, current or PWM after a write to registers. ``sign``: of the servo's direction.

        Velocity control follows an angle that moves with the velocity. Goal PWM and Goal Current begin at their limits. The manual does
        not say that a motor then runs at full power, so it waits for the first goal.
        """
        table, drive = self._table, self._drive
        mode = table[ct.OPERATING_MODE]
        if mode in ct.POSITION_MODES or _SETS_MOTION.isdisjoint(touched):
            return
        self._given_goals.update(_GOALS_WITH_DEFAULT.intersection(touched))
        pwm, current, velocity, acceleration = struct.unpack_from("<hhiI", table, ct.GOAL_PWM)
        if mode == ct.PWM:
            drive.volt = sign * pwm / FULL_PWM * SUPPLY_V if ct.GOAL_PWM in self._given_goals else 0.0
        elif mode == ct.CURRENT:
            drive.push(sign * current * nm_a_unit if ct.GOAL_CURRENT in self._given_goals else 0.0)
        else:
            if drive.profile is None:
                drive.profile = Profile()
                drive.profile.stop(drive.angle)
            drive.profile.keep_speed(sign * velocity * RAD_S_A_UNIT, acceleration * _RAD_S2_A_UNIT)

    def forget_goals(self) -> None:
        """End every movement. A servo does this when it starts and when its mode changes."""
        self._given_goals.clear()
        self._drive.profile = self._drive.volt = None

    def forget_profile(self) -> None:
        """Set the profile to 0. A servo does this when its bus watchdog stops it."""
        self._table[ct.PROFILE : ct.PROFILE + 8] = bytes(8)
