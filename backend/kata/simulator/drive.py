"""Simulates a drive without its protocol: position control with limited torque, and a bus watchdog.

Units are radians, seconds and Nm. The registers of a protocol (:mod:`~kata.simulator.servos`,
:mod:`~kata.simulator.modbus_drive`) set and read
the drive. :func:`kata.simulator.plant.step_axis` runs the drive's control together with the mechanics.

The control is that of a servo drive: the position error determines a speed, and a PI control of the speed determines the torque. As a
PID, this is P on the position, D on the measured speed, and an integral of both. The integral compensates friction and weight, but the
drive's lag (D divided by P) does not accumulate in it as an error.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final, Literal

from msgspec import Struct

from kata.simulator.parameters import (
    COUNTS_A_TURN,
    DRIVER_EFFICIENCY,
    HEATING_S,
    NM_AN_AMPERE,
    RESISTANCE_OHM,
    STEP_S,
    SUPPLY_V,
    SUPPLY_W,
    DriveParameters,
)
from kata.simulator.profile import Profile

COUNTS_A_RAD: Final = COUNTS_A_TURN / math.tau
"""Number of encoder counts in a radian."""

DriveEvent = Literal["goal", "torque"]


class DriveReport(Struct, frozen=True):
    """Values that a drive reports, in rad, rad/s and Nm."""

    angle: float
    speed: float
    torque_nm: float


class Drive:
    """One motor with its controller. ``torque_nm``: its present torque."""

    def __init__(
        self, motor: int, parameters: DriveParameters, on_event: Callable[[int, DriveEvent, float], None]
    ) -> None:
        """Create the drive without torque. ``on_event`` is called at each goal (degrees) and each torque switching (1, 0)."""
        self.motor = motor
        self.torque_on = False
        self.torque_nm = 0.0
        self.goal = 0.0
        self.profile: Profile | None = None
        """The trajectory that leads to the goal; None: the goal is approached at once."""
        self.volt: float | None = None
        """Voltage at the motor, which replaces the position control; None in all other modes."""
        self.watchdog_s = 0.0
        """The drive stops at its present position after a longer silence on the bus; 0: never."""
        self.tripped = False
        self.contacts: dict[int, bool] = {}
        """True if the contact is closed to ground, by number of the external port."""
        self.frozen: DriveReport | None = None
        """The report that a faulty drive repeats."""
        self.angle = 0.0
        """True angle of the shaft."""
        self.speed = 0.0
        self.p_nm_rad = 0.0
        self.i_nm_rad_s = 0.0
        self.lag_s = 0.0
        """The drive's lag: D divided by P."""
        self.feed_s = 0.0
        self.feed_s2 = 0.0
        """Factors of the trajectory's speed and acceleration in :attr:`lead`."""
        self.limit_nm = 0.0
        """Present torque limit: the lowest of the limits by setting, motor and supply."""
        self.smoothed_goal = 0.0
        self.integral_nm = 0.0
        self._parameters = parameters
        self._on_event = on_event
        self._set_nm = 0.0
        self._available_nm = parameters.maximum_nm
        self._heat_nm2 = 0.0
        self._silent_steps = 0

    @property
    def report(self) -> DriveReport:
        """The values that the drive's registers report. They do not change while the drive is frozen."""
        return self.frozen or DriveReport(self._position, self.speed, self.torque_nm)

    @property
    def _position(self) -> float:
        return round(self.angle * COUNTS_A_RAD) / COUNTS_A_RAD

    @property
    def followed_goal(self) -> float:
        """The angle that the position control follows now."""
        return self.goal if self.profile is None else self.profile.angle

    @property
    def lead(self) -> float:
        """The angle by which the feed-forward of a moving trajectory leads the followed goal."""
        profile = self.profile
        return 0.0 if profile is None else self.feed_s * profile.speed + self.feed_s2 * profile.acceleration

    @property
    def moves_its_goal(self) -> bool:
        """True if :meth:`move_goal` must be called at each step."""
        return self.torque_on and (self.volt is not None or (self.profile is not None and self.profile.moves))

    def move_goal(self, dt_s: float) -> None:
        """Advance the trajectory, and update the torque of a motor with a given voltage."""
        if self.profile is not None:
            self.profile.advance(dt_s)
        if self.volt is not None:
            self.integral_nm = NM_AN_AMPERE * (self.volt - NM_AN_AMPERE * self.speed) / RESISTANCE_OHM

    def push(self, torque_nm: float) -> None:
        """Set the torque of a drive whose gains are 0."""
        self.integral_nm = torque_nm

    def tune(self, p_nm_rad: float, i_nm_rad_s: float, d_nm_s_rad: float, limit_nm: float) -> None:
        """Set the gains of the position control and the torque limit."""
        self.p_nm_rad, self.i_nm_rad_s = p_nm_rad, i_nm_rad_s
        self.lag_s = d_nm_s_rad / p_nm_rad if p_nm_rad else 0.0
        self._set_nm = limit_nm
        self.limit_nm = min(limit_nm, self._available_nm)

    def feed_forward(self, nm_s_rad: float, nm_s2_rad: float) -> None:
        """Set the torque for each rad/s and each rad/s2 of the trajectory. Call it after :meth:`tune`."""
        p = self.p_nm_rad
        self.feed_s, self.feed_s2 = (nm_s_rad / p, nm_s2_rad / p) if p else (0.0, 0.0)

    def switch(self, on: bool) -> None:
        """Switch torque on or off. When torque is switched on, the drive holds its position."""
        if on == self.torque_on:
            return
        self.torque_on = on
        if on:
            self.integral_nm = 0.0
            self.goal = self.smoothed_goal = self._position
            if self.profile is not None:
                self.profile.stop(self.goal)
        else:
            self.torque_nm = 0.0
        self._on_event(self.motor, "torque", float(on))

    def set_goal(self, goal: float) -> None:
        """Set a goal that was received from the bus."""
        self.goal = goal
        self._on_event(self.motor, "goal", math.degrees(goal))

    def feed_watchdog(self) -> None:
        """Reset the watchdog's time. The bus calls this for every valid message."""
        self._silent_steps = 0

    # -- time -----------------------------------------------------------------------------------------------------

    @property
    def steps_to_trip(self) -> int:
        """Number of silent steps until the active watchdog trips."""
        return int(self.watchdog_s / STEP_S + 1e-6) + 1 - self._silent_steps

    @property
    def watchdog_active(self) -> bool:
        """True if the bus watchdog is active."""
        return self.torque_on and self.watchdog_s > 0.0 and not self.tripped

    def count_silent_steps(self, steps: int) -> bool:
        """Count silent steps of the active watchdog. Return True if it trips. Torque stays on."""
        self._silent_steps += steps
        if self.steps_to_trip > 0:
            return False
        self.tripped = True
        self.goal = self._position
        self.profile = self.volt = None
        if not self.p_nm_rad:
            self.integral_nm = 0.0
        return True

    # -- supply ---------------------------------------------------------------------------------------------------

    @property
    def power_w(self) -> float:
        """Power in W that the drive takes from its supply; 0 while the motor brakes."""
        current = self.torque_nm / NM_AN_AMPERE
        return max(0.0, current * (RESISTANCE_OHM * current + NM_AN_AMPERE * self.speed)) / DRIVER_EFFICIENCY

    def supply(self, share: float, dt_s: float) -> None:
        """Update the torque limit. The supply's voltage limits it at this speed. If the supply's power is insufficient, ``share``
        of the present torque limits it. If the winding is warm, the rated torque limits it.
        """
        self._heat_nm2 += (self.torque_nm**2 - self._heat_nm2) * (dt_s / HEATING_S)
        warm = self._heat_nm2 > self._parameters.rated_nm**2
        motor_nm = self._parameters.rated_nm if warm else self._parameters.maximum_nm
        voltage_nm = NM_AN_AMPERE * max(0.0, SUPPLY_V - NM_AN_AMPERE * abs(self.speed)) / RESISTANCE_OHM
        self._available_nm = min(motor_nm, voltage_nm)
        if share < 1.0:
            self._available_nm = min(self._available_nm, abs(self.torque_nm) * share)
        self.limit_nm = min(self._set_nm, self._available_nm)


def share_supply(drives: Sequence[Drive], dt_s: float) -> None:
    """Share a supply's power among its drives."""
    demand_w = sum([drive.power_w for drive in drives])
    share = SUPPLY_W / demand_w if demand_w > SUPPLY_W else 1.0
    for drive in drives:
        drive.supply(share, dt_s)
