"""Models motors from their data sheets, and the documented position control of an X-series servo.

Source of the control: ROBOTIS e-manual, X series, "Position PID Gain": ``K_P = P / 128``, ``K_I = I / 65536``, ``K_D = D / 16`` on the
position error in pulses. The output is a PWM of 885 units at full voltage (0.113 % each). The manual does not state the control period,
the signal that the D term differentiates, or the anti-windup gain. We assume 1 ms, the measured position, and an integral that does not
grow while the output is limited in the integral's direction.
"""

import math
from dataclasses import dataclass
from typing import Final

from kata.simulator.parameters import COUNTS_A_TURN, NM_AN_AMPERE, RESISTANCE_OHM

FULL_PWM: Final = 885
"""Largest PWM, register 36."""
CONTROL_PERIOD_S: Final = 0.001
"""Assumed; see the module's docstring."""
_PULSES_A_RAD: Final = COUNTS_A_TURN / math.tau
_P, _I, _D = 128, 65_536, 16


@dataclass(frozen=True)
class Motor:
    """A geared DC motor. Its values apply at the output shaft."""

    nm_an_ampere: float
    v_s_a_rad: float
    """Back-EMF constant: the supply's voltage divided by the no-load speed."""
    resistance_ohm: float
    backlash_deg: float | None
    """None if no data sheet states it."""


def _from_data_sheet(stall_nm: float, stall_a: float, volts: float, no_load_rpm: float, backlash_deg: float) -> Motor:
    return Motor(stall_nm / stall_a, volts / (no_load_rpm * math.tau / 60), volts / stall_a, backlash_deg)


MOTORS: Final = {
    # Sun et al. 2025, Table 1. Resistance and back-EMF are derived; see kata.simulator.parameters.
    "PX-320": Motor(NM_AN_AMPERE, NM_AN_AMPERE, RESISTANCE_OHM, None),
    # ROBOTIS e-manual, pages of the models: stall torque and current, voltage, no-load speed, backlash.
    "XH540-V270": _from_data_sheet(9.2, 2.4, 24.0, 34.0, 0.25),
    "XH540-V150": _from_data_sheet(6.4, 2.4, 24.0, 60.0, 0.25),
    "XM540-W270": _from_data_sheet(10.6, 4.4, 12.0, 30.0, 0.25),
    "XM540-W150": _from_data_sheet(7.3, 4.4, 12.0, 53.0, 0.25),
}
"""Motors by model name. The X series includes its gear of 272.5 : 1 or 152.3 : 1."""


@dataclass(frozen=True)
class PositionGains:
    """Registers 84, 82 and 80 of a servo."""

    p: float
    i: float
    d: float


class PositionControl:
    """The position PID of one servo and its motor. It only calculates torque."""

    def __init__(self, motor: Motor) -> None:
        self.motor = motor
        self.pwm = 0.0
        """Present PWM, -885 to 885."""
        self.current_a = 0.0
        self._sum_pulses = 0.0

    def reset(self) -> None:
        """Reset the integral. A servo does this when its torque is switched on."""
        self._sum_pulses = self.pwm = self.current_a = 0.0

    def step(
        self, gains: PositionGains, goal_rad: float, angle_rad: float, speed_rad_s: float, supply: tuple[float, float]
    ) -> float:
        """Advance by one control period. Return the torque at the shaft in Nm.

        :param angle_rad: true angle, which the servo measures in whole pulses.
        :param supply: voltage at full PWM in V, and current limit in A.
        """
        volts, limit_a = supply
        motor = self.motor
        error = goal_rad * _PULSES_A_RAD - (angle_rad * _PULSES_A_RAD + 0.5) // 1.0
        pwm = (
            gains.p / _P * error
            + gains.i / _I * self._sum_pulses
            - gains.d / _D * (speed_rad_s * _PULSES_A_RAD * CONTROL_PERIOD_S)
        )
        # Comparisons take a fraction of the time of min and max, and a simulation spends much of its time here.
        limited = pwm if -FULL_PWM <= pwm <= FULL_PWM else math.copysign(FULL_PWM, pwm)
        wanted_a = (limited / FULL_PWM * volts - motor.v_s_a_rad * speed_rad_s) / motor.resistance_ohm
        current = wanted_a if -limit_a <= wanted_a <= limit_a else math.copysign(limit_a, wanted_a)
        if (limited == pwm and current == wanted_a) or error * current < 0.0:
            self._sum_pulses += error
        self.pwm, self.current_a = limited, current
        return motor.nm_an_ampere * current
