"""The feed-forward follows its target without jumps, and the setpoint brakes before the limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.movement import longest_step
from kata.device.setpoint_limiters import LimitedFeedForward, SetpointBrake, longest_steps
from kata.motion.linkage import Floats
from tests.support.examples import examples

LARGEST_DEG, CLOSING_DEG, SECOND_DIFFERENCE_DEG = 1.2, 0.2, 0.2


def followed(targets_deg: Floats, second_difference_deg: float = SECOND_DIFFERENCE_DEG) -> Floats:
    """Return the feed-forward for each target of one axis."""
    feed_forward = LimitedFeedForward(np.array([LARGEST_DEG]), np.array([CLOSING_DEG]))
    followed_deg = []
    for target_deg in targets_deg:
        feed_forward.follow(np.array([target_deg]), np.array([second_difference_deg]))
        followed_deg.append(feed_forward.deg[0])
    return np.array(followed_deg)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_target_is_followed_exactly_if_its_acceleration_is_allowed(direction: float) -> None:
    """Its fastest step is 1 deg, five times the largest change of a step."""
    times_s = np.arange(0.0, 1.0, 0.01)
    targets_deg = direction * 10.0 * (1 - np.cos(10.0 * times_s))
    assert np.abs(np.diff(targets_deg)).max() > 0.99
    assert followed(targets_deg) == pytest.approx(targets_deg, abs=1e-9)


def test_jump_of_the_target_is_closed_slowly_and_without_overshoot() -> None:
    followed_deg = followed(np.full(60, 5.0))
    steps = np.diff(followed_deg, prepend=0.0)
    assert followed_deg[0] == pytest.approx(SECOND_DIFFERENCE_DEG)
    assert steps.max() <= CLOSING_DEG + 1e-9
    assert steps.min() >= -1e-9
    assert followed_deg[-1] == pytest.approx(5.0)
    assert np.count_nonzero(followed_deg < 4.999) == 24


def test_fast_feed_forward_stops_before_another_path_may_begin() -> None:
    feed_forward = LimitedFeedForward(np.array([LARGEST_DEG] * 2), np.array([CLOSING_DEG] * 2))
    allowed = np.full(2, SECOND_DIFFERENCE_DEG)
    could_stop = []
    for step in range(14):
        # The second axis moves fast for 6 setpoints.
        feed_forward.follow(np.array([0.0, 0.5 * min(step, 6)]), allowed)
        could_stop.append(feed_forward.can_stop)
    assert could_stop == [True] * 2 + [False] * 6 + [True] * 6
    feed_forward.start()
    assert feed_forward.deg == pytest.approx([0.0, 0.0])
    assert feed_forward.can_stop


@given(
    st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=40),
    st.lists(st.floats(0.05, 0.2), min_size=1, max_size=40),
)
@examples(few=50, many=1000)
def test_steps_and_their_changes_stay_within_the_limits(targets_deg: list[float], allowed_deg: list[float]) -> None:
    feed_forward = LimitedFeedForward(np.array([LARGEST_DEG]), np.array([CLOSING_DEG]))
    last_deg = step_deg = 0.0
    for n, target_deg in enumerate([*targets_deg, *[targets_deg[-1]] * 1000]):
        allowed = allowed_deg[n % len(allowed_deg)]
        feed_forward.follow(np.array([target_deg]), np.array([allowed]))
        next_step = float(feed_forward.deg[0]) - last_deg
        assert abs(next_step) <= LARGEST_DEG + 1e-9
        assert abs(next_step - step_deg) <= allowed + 1e-9
        last_deg, step_deg = last_deg + next_step, next_step
    assert last_deg == pytest.approx(targets_deg[-1], abs=1e-6)
    assert feed_forward.can_stop


def test_held_feed_forward_goes_on_from_where_it_is_held() -> None:
    """A limit of the setpoints allowed no step. The next step begins at rest, and not with the step that was not made."""
    feed_forward = LimitedFeedForward(np.array([LARGEST_DEG]), np.array([CLOSING_DEG]))
    for _ in range(3):
        before_deg = feed_forward.deg
        feed_forward.follow(np.array([5.0]), np.array([SECOND_DIFFERENCE_DEG]))
    assert feed_forward.deg - before_deg == pytest.approx([CLOSING_DEG])
    feed_forward.hold(before_deg)
    assert feed_forward.deg == pytest.approx(before_deg)
    feed_forward.follow(np.array([5.0]), np.array([0.05]))
    assert feed_forward.deg - before_deg == pytest.approx([0.05])


LIMIT_DEG, REST_DEG = 1.0, 0.3


@examples(few=50, many=1000)
@given(st.lists(st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]), min_size=1, max_size=60), st.floats(0.01, 0.3))
def test_brake_stops_at_the_limits_and_comes_back(shares: list[float], second_difference_deg: float) -> None:
    """The wanted setpoint leaves the limits, with steps that are allowed. ``shares``: each change of its step, in parts of the largest."""
    brake = SetpointBrake(np.array([second_difference_deg]))
    limits_deg = np.array([-LIMIT_DEG]), np.array([LIMIT_DEG])
    wanted_deg = step_deg = last_deg = last_step_deg = 0.0
    for n in range(1000):
        if n < len(shares):
            step_deg += shares[n] * second_difference_deg
        else:  # back, and rest
            left_deg = REST_DEG - wanted_deg
            back_deg = np.sign(left_deg) * longest_step(abs(left_deg), second_difference_deg)
            step_deg += float(np.clip(back_deg - step_deg, -second_difference_deg, second_difference_deg))
        wanted_deg += step_deg
        setpoint_deg = float(brake.setpoint(np.array([wanted_deg]), *limits_deg)[0])
        assert abs(setpoint_deg) <= LIMIT_DEG + 1e-9
        assert abs(setpoint_deg - last_deg - last_step_deg) <= second_difference_deg + 1e-9
        assert setpoint_deg == wanted_deg or abs(setpoint_deg - wanted_deg) >= 1e-9, "not only nearly caught up"
        last_deg, last_step_deg = setpoint_deg, setpoint_deg - last_deg
    assert wanted_deg == pytest.approx(REST_DEG, abs=1e-6)
    assert setpoint_deg == wanted_deg


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_setpoint_beyond_a_limit_moves_inwards_only(direction: float) -> None:
    """An arm may be picked up outside its limits."""
    brake = SetpointBrake(np.array([0.1]))
    brake.start(np.array([direction * 1.5]))
    for further_deg, expected_deg in ((0.0, 1.5), (0.05, 1.5), (0.0, 1.5), (-0.05, 1.45), (-0.15, 1.35)):
        wanted = np.array([direction * (1.5 + further_deg)])
        setpoint = brake.setpoint(wanted, np.array([-LIMIT_DEG]), np.array([LIMIT_DEG]))
        assert setpoint == pytest.approx([direction * expected_deg])


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_brake_lets_a_motion_within_the_limits_pass(direction: float) -> None:
    brake = SetpointBrake(np.array([0.1]))
    brake.start(np.array([direction * 0.2]))
    wanted_deg = direction * (0.2 + 0.3 * (1 - np.cos(np.arange(50) / 5.0)))
    held_deg = [
        brake.setpoint(np.array([wanted]), np.array([-LIMIT_DEG]), np.array([LIMIT_DEG]))[0] for wanted in wanted_deg
    ]
    assert held_deg == wanted_deg.tolist()


@examples(few=50, many=500)
@given(st.integers(0, 30), st.floats(-0.2, 0.2), st.floats(1e-3, 1.0))
def test_longest_step_uses_the_whole_distance(whole: int, beyond: float, second_difference_deg: float) -> None:
    """Each step may be shorter than the one before by the second difference. ``beyond``: near a distance that whole steps fill."""
    left_deg = max(0.0, whole * (whole + 1) / 2 + beyond) * second_difference_deg
    step_deg = float(longest_steps(np.array([left_deg]), np.array([second_difference_deg]))[0])
    stopping_deg = sum(max(0.0, step_deg - n * second_difference_deg) for n in range(whole + 3))
    assert stopping_deg == pytest.approx(left_deg, abs=1e-9)
    assert step_deg == pytest.approx(longest_step(left_deg, second_difference_deg), abs=1e-12)


@pytest.mark.parametrize(("step_deg", "way_deg"), [(0.35, 0.25 + 0.15 + 0.05), (-0.25, -0.15 - 0.05), (0.09, 0.0)])
def test_brake_knows_where_the_setpoint_can_stop(step_deg: float, way_deg: float) -> None:
    brake = SetpointBrake(np.array([0.1]))
    brake.start(np.array([20.0]))
    for n in range(1, 6):
        setpoint_deg = brake.setpoint(np.array([20.0 + n * step_deg]), np.array([-100.0]), np.array([100.0]))
    assert setpoint_deg[0] == pytest.approx(20.0 + 5 * step_deg)
    assert brake.stop_deg[0] == pytest.approx(setpoint_deg[0] + way_deg)
