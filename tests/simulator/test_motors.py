"""The servos' position control against values calculated by hand from the manual's formulas."""

import math

import pytest

from kata.simulator.motors import MOTORS, Motor, PositionControl, PositionGains

PULSE = math.tau / 4096
SUPPLY = (24.0, 100.0)
"""Volts, and a current limit that is never reached."""
MOTOR = Motor(nm_an_ampere=2.0, v_s_a_rad=3.0, resistance_ohm=4.0, backlash_deg=None)


def test_p_is_divided_by_128() -> None:
    """10 pulses x 800 / 128 = 62.5 of 885 units: 62.5 / 885 x 24 V / 4 ohm x 2 Nm/A."""
    control = PositionControl(MOTOR)
    torque = control.step(PositionGains(800, 0, 0), 10 * PULSE, 0.0, 0.0, SUPPLY)
    assert control.pwm == pytest.approx(62.5)
    assert torque == pytest.approx(0.84746, abs=1e-5)


def test_i_is_divided_by_65536_and_sums_pulses_each_millisecond() -> None:
    control = PositionControl(MOTOR)
    for _ in range(101):
        control.step(PositionGains(0, 6554, 0), 10 * PULSE, 0.0, 0.0, SUPPLY)
    assert control.pwm == pytest.approx(100 * 10 * 6554 / 65_536)


def test_d_is_divided_by_16_and_brakes() -> None:
    """1 rad/s is 651.9 pulses in a second, 0.6519 in a millisecond."""
    control = PositionControl(Motor(2.0, 0.0, 4.0, None))
    control.step(PositionGains(0, 0, 160), 0.0, 0.0, 1.0, SUPPLY)
    assert control.pwm == pytest.approx(-6.519, abs=1e-3)


def test_back_emf_reduces_the_current() -> None:
    """Full PWM at 4 rad/s: (24 V - 3 x 4 V) / 4 ohm = 3 A."""
    control = PositionControl(MOTOR)
    assert control.step(PositionGains(16_000, 0, 0), 1.0, 0.0, 4.0, SUPPLY) == pytest.approx(6.0)
    assert control.pwm == 885
    assert control.current_a == pytest.approx(3.0)


def test_current_is_limited_and_the_integral_waits() -> None:
    control = PositionControl(MOTOR)
    gains = PositionGains(16_000, 16_000, 0)
    for _ in range(1000):
        assert control.step(gains, 1.0, 0.0, 0.0, (24.0, 0.5)) == pytest.approx(1.0)
    # Had the sum grown, the torque would stay positive here.
    assert control.step(gains, -1.0, 0.0, 0.0, (24.0, 0.5)) == pytest.approx(-1.0)


def test_angle_is_measured_in_whole_pulses() -> None:
    control = PositionControl(MOTOR)
    assert control.step(PositionGains(800, 0, 0), 0.0, 0.49 * PULSE, 0.0, SUPPLY) == 0.0
    assert control.step(PositionGains(800, 0, 0), 0.0, 0.51 * PULSE, 0.0, SUPPLY) < 0.0


@pytest.mark.parametrize(
    ("model", "volts", "stall_nm", "no_load_rpm"),
    [("XH540-V270", 24.0, 9.2, 34.0), ("XM540-W270", 12.0, 10.6, 30.0), ("PX-320", 24.0, 38.1, 114.6)],
)
def test_motor_stalls_and_idles_as_its_data_sheet_says(
    model: str, volts: float, stall_nm: float, no_load_rpm: float
) -> None:
    """PX-320 has no such figures: they follow from 10 Nm at 5 A and 22 V at 75 rpm."""
    motor = MOTORS[model]
    assert motor.nm_an_ampere * volts / motor.resistance_ohm == pytest.approx(stall_nm, rel=0.01)
    assert volts / motor.v_s_a_rad * 60 / math.tau == pytest.approx(no_load_rpm, rel=0.01)
