"""The inside of a drive, whatever it speaks: position control with limited torque, and a bus watchdog.

Radians, seconds and Nm. A register face (:mod:`~kata.simulator.servos`, :mod:`~kata.simulator.modbus_drive`) sets it and
reads it. Scale and gains are chosen for the plant, as the real drives' gains are tuned beforehand (Section 2.1 of the
paper).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

COUNTS_A_RAD: Final = 4096 / math.tau
"""Of the encoder."""
_GOAL_SPEED_S: Final = 0.008
"""The drive judges the goal's speed over about this long, for its D part."""

Noticed = Literal["goal", "torque"]


@dataclass(frozen=True)
class Report:
    """What a drive says about itself: rad, rad/s, Nm."""

    angle: float
    speed: float
    torque_nm: float


class Drive:
    """One motor with its controller. ``torque_nm`` is what it presently gives."""

    def __init__(self, motor: int, strength: float, tell: Callable[[int, Noticed, float], None]) -> None:
        """``strength`` below 1: a weaker and looser drive. ``tell`` hears of each goal (degrees) and torque change (1, 0)."""
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
        self._strength = strength
        self._tell = tell
        self._angle = 0.0
        self._speed = 0.0
        self._gains = (0.0, 0.0, 0.0)
        self._limit_nm = 0.0
        self._integral_nm = 0.0
        self._last_goal = 0.0
        self._goal_speed = 0.0
        self._silence_s = 0.0

    @property
    def report(self) -> Report:
        """As its registers have it."""
        return self.frozen or Report(self._position, self._speed, self.torque_nm)

    @property
    def _position(self) -> float:
        return round(self._angle * COUNTS_A_RAD) / COUNTS_A_RAD

    def feel(self, angle: float, speed: float) -> None:
        """Where the shaft is now."""
        self._angle, self._speed = angle, speed

    def tune(self, p_nm_rad: float, i_nm_rad_s: float, d_nm_s_rad: float, limit_nm: float) -> None:
        """Gains of the position control, and the most torque that it may give."""
        scale = self._strength
        self._gains = (p_nm_rad * scale, i_nm_rad_s * scale, d_nm_s_rad * scale)
        self._limit_nm = limit_nm * scale

    def switch(self, on: bool) -> None:
        """Torque on or off. Switched on, it holds where it is."""
        if on == self.torque_on:
            return
        self.torque_on = on
        if on:
            self._integral_nm = self._goal_speed = 0.0
            self.goal = self._last_goal = self._position
        else:
            self.torque_nm = 0.0
        self._tell(self.motor, "torque", float(on))

    def aim(self, goal: float) -> None:
        """A goal came over the bus."""
        self.goal = goal
        self._tell(self.motor, "goal", math.degrees(goal))

    def heard(self) -> None:
        """Any sound word on the bus feeds the watchdog."""
        self._silence_s = 0.0

    def control(self, angle: float, speed: float, dt_s: float) -> None:
        """One step of the control; sets :attr:`torque_nm`."""
        self.feel(angle, speed)
        if not self.torque_on:
            return
        self._watch(dt_s)
        goal = self.goal
        self._goal_speed += ((goal - self._last_goal) / dt_s - self._goal_speed) * (dt_s / _GOAL_SPEED_S)
        self._last_goal = goal
        p, i, d = self._gains
        error = goal - self._position
        self._integral_nm += i * error * dt_s
        self._integral_nm = min(max(self._integral_nm, -self._limit_nm), self._limit_nm)
        torque = p * error + self._integral_nm + d * (self._goal_speed - speed)
        self.torque_nm = min(max(torque, -self._limit_nm), self._limit_nm)

    def _watch(self, dt_s: float) -> None:
        """The bus watchdog; torque stays on."""
        if self.watchdog_s == 0.0 or self.tripped:
            return
        self._silence_s += dt_s
        if self._silence_s > self.watchdog_s:
            self.tripped = True
            self.goal = self._position
