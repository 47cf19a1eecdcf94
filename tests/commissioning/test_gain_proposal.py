"""Gains are proposed from a measured response."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from kata.commissioning.gain_proposal import (
    TARGET_DAMPING,
    Gains,
    are_within_limits,
    damping_ratio,
    gain_limits,
    propose,
)
from kata.commissioning.step_response import StepResponse, step_response
from kata.device.config import simulated
from kata.motion.linkage import Floats

GOOD = StepResponse(0.1, 0.05, 0.05)
REGISTER = st.integers(0, 16_383)
STEP_DEG = 2.0


def responding(gains: Gains, inertia: float) -> StepResponse:
    """Return the response of an inertia with these gains: P torque a deg, D torque a deg/s, without integral."""
    times: Floats = np.arange(0.0, 4.0, 0.0005)
    angle = speed = 0.0
    angles = []
    for _ in times:
        speed += (gains.p * (STEP_DEG - angle) - gains.d * speed) / inertia * 0.0005
        angle += speed * 0.0005
        angles.append(angle)
    return step_response(times, np.array(angles), STEP_DEG)


@given(st.builds(Gains, REGISTER, REGISTER, REGISTER), st.floats(0.0, 2.0), st.floats(0.0, 9.0), st.floats(0.0, 4.0))
def test_no_proposal_is_refused(present: Gains, rise_s: float, overshoot: float, error_deg: float) -> None:
    gains, _ = propose(present, StepResponse(rise_s, overshoot, error_deg))
    assert are_within_limits(gains, present)
    config = simulated("virtual")
    gained = structs.replace(config.axes[0], position_p_gain=gains.p, position_i_gain=gains.i, position_d_gain=gains.d)
    structs.replace(config, axes=(gained, *config.axes[1:]))


@given(st.builds(Gains, REGISTER, REGISTER, REGISTER))
def test_a_good_response_keeps_its_gains(present: Gains) -> None:
    assert propose(present, GOOD) == (present, "")


@pytest.mark.parametrize("share", [0.4, 0.5, 0.55])
def test_damping_is_reached_in_one_trial(share: float) -> None:
    """D alone reaches the wanted damping if it need not be more than doubled."""
    present = Gains(1600, 0, round(2 * share * np.sqrt(1600 * 0.5)))
    gains, advice = propose(present, responding(present, 0.5))
    assert advice == "damp" and gains.p == present.p
    reached = gains.d / (2 * np.sqrt(gains.p * 0.5))
    assert reached == pytest.approx(TARGET_DAMPING, rel=0.06)


def test_less_p_takes_what_the_limit_leaves() -> None:
    gains, _ = propose(Gains(1600, 800, 0), StepResponse(0.05, 0.6, 0.0))
    assert gains == Gains(800, 400, 100)
    gains, _ = propose(Gains(1600, 800, 200), StepResponse(0.05, 0.4, 0.0))
    assert gains.d == 400
    assert gains.p == pytest.approx(1600 * (2 * damping_ratio(0.4) / TARGET_DAMPING) ** 2, abs=1)
    assert gains.i / gains.p == pytest.approx(0.5, abs=0.01), "the integral keeps its time constant"


def test_a_slow_motor_gets_faster_in_one_trial() -> None:
    present = Gains(100, 0, 80)
    before = responding(present, 0.5)
    assert before.overshoot == 0.0 and before.rise_s > 0.9
    gains, advice = propose(present, before)
    after = responding(gains, 0.5)
    assert (advice, gains.d) == ("faster", 80)
    assert after.rise_s < 0.62 * before.rise_s and after.overshoot < 0.1


def test_a_remaining_error_raises_the_integral() -> None:
    assert propose(Gains(1600, 800, 720), StepResponse(0.1, 0.0, 0.375)) == (Gains(1600, 1200, 720), "integrate")
    assert propose(Gains(1600, 0, 720), StepResponse(0.1, 0.0, 0.375)) == (Gains(1600, 100, 720), "integrate")


def test_a_trial_at_most_doubles_or_halves_a_gain() -> None:
    assert gain_limits(Gains(1601, 10, 9000)) == (Gains(801, 5, 4500), Gains(3202, 100, 16_383))
    assert not are_within_limits(Gains(800, 10, 9000), Gains(1601, 10, 9000))
    assert not are_within_limits(Gains(1601, 101, 9000), Gains(1601, 10, 9000))
