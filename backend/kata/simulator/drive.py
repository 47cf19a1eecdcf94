"""The inside of a drive, whatever it speaks: position control with limited torque, and a bus watchdog.

Radians, seconds and Nm. A register face (:mod:`~kata.simulator.servos`, :mod:`~kata.simulator.modbus_drive`) sets it and
reads it; :func:`kata.simulator.plant.turn` runs its control, together with what it moves.

The control is that of a servo drive: the position error asks for a speed, and a PI control of the speed gives the torque. In the
words of a PID that is P and D on position and measured speed, and an integral over both together, so that friction and weight
are taken up without the drive's lag, D over P, being summed up as if it were an error.
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

COUNTS_A_RAD: Final = COUNTS_A_TURN / math.tau
"""Of the encoder."""

Noticed = Literal["goal", "torque"]


class Report(Struct, frozen=True):
    """What a drive says about itself: rad, rad/s, Nm."""

    angle: float
    speed: float
    torque_nm: float


class Drive:
    """One motor with its controller. ``torque_nm`` is what it presently gives."""

    def __init__(self, motor: int, parameters: DriveParameters, tell: Callable[[int, Noticed, float], None]) -> None:
        """``tell`` hears of each goal (degrees) and torque change (1, 0)."""
        self.motor = motor
        self.torque_on = False
        self.torque_nm = 0.0
        self.goal = 0.0
        self.watchdog_s = 0.0
        """Silence on the bus for longer stops the drive where it is; 0: for as long as it likes."""
        self.tripped = False
        self.contacts: dict[int, bool] = {}
        """External port number to whether its contact is closed to ground."""
        self.frozen: Report | None = None
        """A faulty drive's last word, which it goes on repeating."""
        self.angle = 0.0
        """Of its shaft, as it really is."""
        self.speed = 0.0
        self.p_nm_rad = 0.0
        self.i_nm_rad_s = 0.0
        self.lag_s = 0.0
        """D over P."""
        self.limit_nm = 0.0
        """The most torque it presently gives: what it is set to, and what motor and supply have."""
        self.smoothed_goal = 0.0
        self.integral_nm = 0.0
        self._parameters = parameters
        self._tell = tell
        self._set_nm = 0.0
        self._ceiling_nm = parameters.maximum_nm
        self._heat_nm2 = 0.0
        self._silent_steps = 0

    @property
    def report(self) -> Report:
        """As its registers have it."""
        return self.frozen or Report(self._position, self.speed, self.torque_nm)

    @property
    def _position(self) -> float:
        return round(self.angle * COUNTS_A_RAD) / COUNTS_A_RAD

    def tune(self, p_nm_rad: float, i_nm_rad_s: float, d_nm_s_rad: float, limit_nm: float) -> None:
        """Gains of the position control, and the most torque that it may give."""
        self.p_nm_rad, self.i_nm_rad_s = p_nm_rad, i_nm_rad_s
        self.lag_s = d_nm_s_rad / p_nm_rad if p_nm_rad else 0.0
        self._set_nm = limit_nm
        self.limit_nm = min(limit_nm, self._ceiling_nm)

    def switch(self, on: bool) -> None:
        """Torque on or off. Switched on, it holds where it is."""
        if on == self.torque_on:
            return
        self.torque_on = on
        if on:
            self.integral_nm = 0.0
            self.goal = self.smoothed_goal = self._position
        else:
            self.torque_nm = 0.0
        self._tell(self.motor, "torque", float(on))

    def aim(self, goal: float) -> None:
        """A goal came over the bus."""
        self.goal = goal
        self._tell(self.motor, "goal", math.degrees(goal))

    def heard(self) -> None:
        """Any sound word on the bus feeds the watchdog."""
        self._silent_steps = 0

    # -- time -----------------------------------------------------------------------------------------------------

    @property
    def steps_to_trip(self) -> int:
        """How many more of silence the watchdog bears, where it watches."""
        return int(self.watchdog_s / STEP_S + 1e-6) + 1 - self._silent_steps

    @property
    def watching(self) -> bool:
        """The bus watchdog is set, and there is something for it to do."""
        return self.watchdog_s > 0.0 and self.torque_on and not self.tripped

    def pass_steps(self, steps: int) -> bool:
        """So many steps without a word have passed, while it watched; whether the watchdog trips at their end. Torque stays on."""
        self._silent_steps += steps
        if self.steps_to_trip > 0:
            return False
        self.tripped = True
        self.goal = self._position
        return True

    # -- supply ---------------------------------------------------------------------------------------------------

    @property
    def power_w(self) -> float:
        """What it takes from its supply; a braking motor takes nothing."""
        current = self.torque_nm / NM_AN_AMPERE
        return max(0.0, current * (RESISTANCE_OHM * current + NM_AN_AMPERE * self.speed)) / DRIVER_EFFICIENCY

    def supply(self, share: float, dt_s: float) -> None:
        """Work out the torque there is: what the supply's voltage drives against this speed, ``share`` of the present torque
        where its power does not suffice, and no more than the rated torque once the winding is warm.
        """
        self._heat_nm2 += (self.torque_nm**2 - self._heat_nm2) * (dt_s / HEATING_S)
        warm = self._heat_nm2 > self._parameters.rated_nm**2
        most = self._parameters.rated_nm if warm else self._parameters.maximum_nm
        driven = NM_AN_AMPERE * max(0.0, SUPPLY_V - NM_AN_AMPERE * abs(self.speed)) / RESISTANCE_OHM
        self._ceiling_nm = min(most, driven)
        if share < 1.0:
            self._ceiling_nm = min(self._ceiling_nm, abs(self.torque_nm) * share)
        self.limit_nm = min(self._set_nm, self._ceiling_nm)


def share_supply(drives: Sequence[Drive], dt_s: float) -> None:
    """Let the drives on one supply have what it gives."""
    taken_w = sum([drive.power_w for drive in drives])
    share = SUPPLY_W / taken_w if taken_w > SUPPLY_W else 1.0
    for drive in drives:
        drive.supply(share, dt_s)
