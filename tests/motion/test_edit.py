"""Edits of motions of every shape."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.device.config import StationConfig
from kata.motion import edit
from kata.motion.approach import MinimumJerkMove
from kata.motion.axes import AXES
from kata.motion.builtin import built_in_motions
from kata.motion.edit import EditError, Motion, PlaybackSettings
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.shoulder import rest_posture_deg
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError

CONFIG = StationConfig()
LIMITS = [
    AxisLimits(axis.min_deg, axis.max_deg, axis.max_speed_deg_s, axis.max_acceleration_deg_s2) for axis in CONFIG.axes
]
MIDDLE_DEG = np.array([(axis.min_deg + axis.max_deg) / 2 for axis in CONFIG.axes])
GENTLE_DEG_S2 = 1000.0
"""Far below the station's 20,000: a jump by half a degree within 10 ms is 5,000."""


def waves(turns: list[float], sizes_deg: list[float], duration_s: float, rate_hz: int) -> Motion:
    """Return five axes, each a sine around the middle of its range, that begin and end anywhere in full motion."""
    times = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    phase = 2 * np.pi * np.outer(times / times[-1], turns) + np.arange(5)
    return Motion(times, MIDDLE_DEG + np.sin(phase) * sizes_deg)


motions = st.builds(
    waves,
    st.lists(st.floats(0.2, 2.0), min_size=5, max_size=5),
    st.lists(st.floats(2.0, 20.0), min_size=5, max_size=5),
    st.floats(3.0, 9.0),
    st.sampled_from([50, 100]),
)
any_motion = settings(max_examples=40)


def built_in(number: int) -> Motion:
    taught = built_in_motions()[number - 1]
    return Motion(taught.times_s, motor_angles_deg(taught.poses_deg))


def playable(motion: Motion, acceleration_deg_s2: float = GENTLE_DEG_S2) -> None:
    """Require that the motion is within the station's limits, without a jump."""
    limits = [limit._replace(max_acceleration_deg_s2=acceleration_deg_s2) for limit in LIMITS]
    Trajectory(motion.times_s, motion.angles_deg).check(limits, CONFIG.limit_tolerance_deg / 2)


def ranges(motion: Motion) -> Floats:
    reach: Floats = np.ptp(motion.angles_deg, axis=0)
    return reach


def same(one: Motion, other: Motion, abs_deg: float = 1e-9) -> None:
    times = np.linspace(0.0, one.duration_s, 300)
    assert other.duration_s == pytest.approx(one.duration_s, abs=1e-5)
    assert other.at(times) == pytest.approx(one.at(times), abs=abs_deg)


# -- one motion -----------------------------------------------------------------------------------------------------


@any_motion
@given(motions, st.floats(0.0, 0.3), st.floats(0.0, 0.3), st.floats(0.0, 0.2), st.floats(0.0, 0.2))
def test_to_trim_twice_is_to_trim_once(motion: Motion, a: float, b: float, c: float, d: float) -> None:
    whole = motion.duration_s
    first = edit.trim(motion, a * whole, whole - b * whole)
    second = edit.trim(first, c * first.duration_s, first.duration_s - d * first.duration_s)
    start = a * whole + c * first.duration_s
    same(second, edit.trim(motion, start, min(start + second.duration_s, whole)), abs_deg=0.02)
    same(edit.trim(motion, 0.0, whole), motion)
    assert len(second.done) == 2


@pytest.mark.parametrize("times", [(-0.1, 2.0), (1.0, 1.4), (2.0, 1.0), (0.0, 99.0), (float("nan"), 2.0)])
def test_trim_stays_within_the_motion(times: tuple[float, float]) -> None:
    with pytest.raises(EditError, match=r"at least 0\.5 s"):
        edit.trim(built_in(4), *times)


@any_motion
@given(motions, st.floats(10.0, 150.0))
def test_speed_changes_the_clock_and_no_angle(motion: Motion, percent: float) -> None:
    faster = edit.at_speed(motion, percent)
    assert faster.duration_s == pytest.approx(motion.duration_s * 100 / percent)
    assert faster.angles_deg.min(axis=0) == pytest.approx(motion.angles_deg.min(axis=0))
    assert faster.angles_deg.max(axis=0) == pytest.approx(motion.angles_deg.max(axis=0))
    assert faster.at(motion.times_s * 100 / percent) == pytest.approx(motion.angles_deg)


def test_ten_hertz_recordings_can_be_slowed_to_a_tenth() -> None:
    motion = waves([1.0] * 5, [10.0] * 5, 5.0, 10)
    slow = edit.at_speed(motion, 10.0)
    assert np.max(np.diff(slow.times_s)) == pytest.approx(0.1)
    playable(slow)


@any_motion
@given(motions, st.floats(0.0, 100.0), st.sets(st.sampled_from(AXES), min_size=1))
def test_less_range_comes_nearer_to_rest_and_never_leaves(motion: Motion, percent: float, axes: set[int]) -> None:
    smaller = edit.scaled(motion, percent, axes)
    low, high = motion.angles_deg.min(axis=0), motion.angles_deg.max(axis=0)
    assert np.all(smaller.angles_deg >= low)
    assert np.all(smaller.angles_deg <= high)
    some = [axis - 1 for axis in axes]
    others = [axis - 1 for axis in AXES if axis not in axes]
    assert ranges(smaller)[some] == pytest.approx(ranges(motion)[some] * percent / 100, abs=1e-9)
    rest = rest_posture_deg(motion.angles_deg)
    assert np.all(np.abs(smaller.angles_deg - rest) <= np.abs(motion.angles_deg - rest) + 1e-9)
    assert np.array_equal(smaller.angles_deg[:, others], motion.angles_deg[:, others])
    assert np.array_equal(smaller.times_s, motion.times_s)


def test_a_reduced_motion_still_starts_where_the_arm_rests() -> None:
    for number in range(1, 8):
        motion = built_in(number)
        assert edit.scaled(motion, 50.0).angles_deg[[0, -1]] == pytest.approx(motion.angles_deg[[0, -1]])


def test_motion_that_starts_raised_is_reduced_towards_its_lowest() -> None:
    raised = edit.trim(built_in(4), 4.0, 8.0)
    smaller = edit.scaled(raised, 50.0)
    assert raised.angles_deg[0, 2] > 60
    assert np.all(smaller.angles_deg[:, 2] <= raised.angles_deg[:, 2] + 1e-9)
    assert smaller.angles_deg[:, 2].min() == pytest.approx(raised.angles_deg[:, 2].min())


@any_motion
@given(motions)
def test_edits_of_the_whole_range_change_nothing(motion: Motion) -> None:
    for unchanged in (
        edit.scaled(motion, 100.0),
        edit.at_speed(motion, 100.0),
        edit.repeated(motion, 1, 5.0),
        edit.reduced(motion, 0.0),
        edit.isolated(motion, AXES),
        edit.with_settings(motion, PlaybackSettings()),
    ):
        assert np.array_equal(unchanged.angles_deg, motion.angles_deg)
        assert np.array_equal(unchanged.times_s, motion.times_s)


def test_reduction_in_degrees_applies_to_the_axis_moving_farthest() -> None:
    motion = built_in(4)
    smaller = edit.reduced(motion, 5.0)
    assert ranges(smaller)[2] == pytest.approx(ranges(motion)[2] - 5.0)
    with pytest.raises(EditError, match="covers only 95"):
        edit.reduced(motion, 95.1)


@any_motion
@given(motions, st.sets(st.sampled_from(AXES), min_size=1))
def test_isolated_axes_move_unchanged_and_others_rest(motion: Motion, axes: set[int]) -> None:
    alone = edit.isolated(motion, axes)
    for axis in AXES:
        column = alone.angles_deg[:, axis - 1]
        if axis in axes:
            assert np.array_equal(column, motion.angles_deg[:, axis - 1])
        else:
            assert np.all(column == motion.angles_deg[0, axis - 1])


@any_motion
@given(motions, st.floats(0.0, 1.0), st.floats(0.0, 3.0))
def test_hold_pauses_the_motion_on_an_unchanged_path(motion: Motion, share: float, hold_s: float) -> None:
    at_s = share * motion.duration_s
    waits = edit.held(motion, at_s, hold_s)
    playable(waits)
    # Up to 0.2 s to come to rest, and as much to continue.
    assert motion.duration_s + hold_s <= waits.duration_s + 1e-6
    assert waits.duration_s <= motion.duration_s + hold_s + 0.4 + 1e-6
    assert ranges(waits) == pytest.approx(ranges(motion), abs=0.05)
    if hold_s > 0.1:
        stands = np.all(np.diff(waits.angles_deg, axis=0) == 0.0, axis=1)
        assert np.sum(np.diff(waits.times_s)[stands]) == pytest.approx(hold_s, abs=0.03)


@any_motion
@given(motions)
def test_eased_motion_starts_and_ends_at_rest_on_its_path(motion: Motion) -> None:
    rests = edit.eased(motion)
    playable(rests)
    for ends in (rests.at(np.array([0.0, 0.02])), rests.at(np.array([rests.duration_s - 0.02, rests.duration_s]))):
        assert np.max(np.abs(np.diff(ends, axis=0))) / 0.02 <= 2.5
    assert rests.angles_deg[0] == pytest.approx(motion.angles_deg[0])
    assert rests.angles_deg[-1] == pytest.approx(motion.angles_deg[-1])
    same(edit.eased(rests), rests)
    # In the middle only the clock has changed.
    middle = np.linspace(0.5, motion.duration_s - 0.5, 50)
    shift_s = 0.2 if edit._goes(motion) else 0.0
    assert rests.at(middle + shift_s) == pytest.approx(motion.at(middle), abs=1e-6)


# -- many of one motion ---------------------------------------------------------------------------------------------


def way_s(start: Floats, goal: Floats) -> float:
    if np.max(np.abs(start - goal)) < 1e-3:
        return 0.0
    return MinimumJerkMove(start, goal, edit.JOIN_SPEED_DEG_S).duration_s


pauses = st.just(0.0) | st.floats(0.002, 4.0)
"""Either no pause, or one longer than the shortest gap between samples."""


def test_tiny_pause_is_ignored() -> None:
    motion = built_in(1)
    assert edit.repeated(motion, 3, 6e-5).duration_s == edit.repeated(motion, 3, 0.0).duration_s


@any_motion
@given(motions, st.integers(2, 5), pauses)
def test_repetitions_last_as_long_as_their_parts_and_never_jump(motion: Motion, count: int, pause_s: float) -> None:
    one = edit.eased(motion)
    again = edit.repeated(motion, count, pause_s)
    back_s = way_s(one.angles_deg[-1], one.angles_deg[0])
    between_s = pause_s + back_s + (pause_s if back_s else 0.0)
    assert again.duration_s == pytest.approx(count * one.duration_s + (count - 1) * between_s, abs=1e-5)
    playable(again)
    every_s = one.duration_s + between_s
    times = np.linspace(0.0, one.duration_s, 100)
    for n in range(count):
        assert again.at(times + n * every_s) == pytest.approx(one.at(times), abs=0.02)


def test_closed_motion_pauses_once_between_repetitions() -> None:
    motion = built_in(4)
    assert np.array_equal(motion.angles_deg[0], motion.angles_deg[-1])
    again = edit.repeated(motion, 10, 2.0)
    assert again.duration_s == pytest.approx(10 * motion.duration_s + 9 * 2.0)
    assert again.done == ("10 repetitions with a pause of 2 s at each end",)


@any_motion
@given(motions, st.floats(1.0, 3.0), st.floats(0.0, 3.0))
def test_warm_up_widens_by_equal_steps_to_the_whole_range(motion: Motion, step: float, times: float) -> None:
    less_deg = min(step * times, 0.9 * float(np.max(ranges(motion))))
    warm = edit.warm_up(motion, less_deg, step)
    playable(warm)
    assert np.max(ranges(warm)) == pytest.approx(np.max(ranges(motion)), abs=0.01)
    axis = int(np.argmax(ranges(motion)))
    reached, at_s = [], 0.0
    count = int(np.ceil(less_deg / step - 1e-9)) + 1
    last: Floats | None = None
    for n in range(count):
        one = edit.eased(edit.reduced(motion, max(0.0, less_deg - n * step)))
        if last is not None:
            at_s += way_s(last, one.angles_deg[0])
        reached.append(float(np.ptp(warm.at(at_s + one.times_s)[:, axis])))
        at_s, last = at_s + one.duration_s, one.angles_deg[-1]
    assert warm.duration_s == pytest.approx(at_s)
    assert np.diff(reached)[:-1] == pytest.approx(step, abs=0.05)
    assert np.all(np.abs(np.diff(reached)[-1:] - step / 2) <= step / 2 + 0.05)


def test_stretch_goes_slowly_up_and_beyond_before_continuing() -> None:
    motion = built_in(5)
    tried = edit.stretch(motion, 4.0, hold_s=2.0)
    playable(tried)
    assert tried.angles_deg[:, 3].max() == pytest.approx(motion.angles_deg[:, 3].max() + 4.0)
    assert tried.angles_deg[-1] == pytest.approx(motion.angles_deg[-1])
    top = int(np.argmax(motion.angles_deg[:, 3]))
    end_deg = motion.angles_deg[top, 3]
    # From the end: back to 5 deg below, and never faster than the stretch's speed until it is finished.
    there = tried.times_s >= motion.times_s[top]
    after = tried.angles_deg[there, 3]
    beyond = int(np.argmax(after))
    assert after[:beyond].min() == pytest.approx(end_deg - 5.0, abs=0.5)
    speeds = np.diff(after[:beyond]) / np.diff(tried.times_s[there][:beyond])
    assert np.max(np.abs(speeds)) <= edit.STRETCH_SPEED_DEG_S + 0.01
    # The other axes repeat the recording.
    others = [0, 1, 2, 4]
    assert ranges(tried)[others] == pytest.approx(ranges(motion)[others], abs=1e-6)


def test_stretch_beyond_the_limit_is_refused_with_motor_and_place() -> None:
    motion = replace(built_in(5), angles_deg=built_in(5).angles_deg + np.array([0, 0, 0, 35.0, 0]))
    playable(motion)
    with pytest.raises(TrajectoryError, match=r"motor 4 would go to 195\.0° at \d+\.\d s; its range is -20 to 190"):
        playable(edit.stretch(motion, 10.0))


def test_motion_made_too_fast_is_refused_with_motor_and_place() -> None:
    motion = waves([2.0] * 5, [2.0, 2.0, 2.0, 30.0, 2.0], 4.0, 100)
    playable(motion)
    with pytest.raises(TrajectoryError, match=r"motor 4 would move at 1\d\d°/s at \d\.\d s; its limit is 100°/s"):
        playable(edit.at_speed(motion, 150.0))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda motion: edit.at_speed(motion, 9.9),
        lambda motion: edit.at_speed(motion, 151.0),
        lambda motion: edit.scaled(motion, 100.1),
        lambda motion: edit.scaled(motion, -1.0),
        lambda motion: edit.isolated(motion, []),
        lambda motion: edit.isolated(motion, [6]),
        lambda motion: edit.held(motion, 99.0, 1.0),
        lambda motion: edit.held(motion, 1.0, -1.0),
        lambda motion: edit.repeated(motion, 0),
        lambda motion: edit.repeated(motion, 2, -1.0),
        lambda motion: edit.warm_up(motion, 10.0, 0.0),
        lambda motion: edit.warm_up(motion, 200.0, 5.0),
        lambda motion: edit.warm_up(motion, 10.0, 0.01),
        lambda motion: edit.warm_up(motion, 10.0, 1.0, 400.0),
        lambda motion: edit.stretch(motion, 5.0, back_deg=200.0),
        lambda motion: edit.stretch(motion, -1.0),
        lambda motion: edit.with_settings(motion, PlaybackSettings(range_percent=5.0)),
    ],
)
def test_nonsensical_edits_are_refused(wrong: object) -> None:
    assert callable(wrong)
    with pytest.raises(EditError):
        wrong(built_in(4))


# -- as asked -------------------------------------------------------------------------------------------------------


def test_edits_are_applied_in_order_range_speed_repetitions() -> None:
    motion = built_in(4)
    asked = edit.with_settings(
        motion, PlaybackSettings(speed_percent=50.0, repetitions=3, pause_s=1.5, range_percent=80.0)
    )
    assert asked.done == (
        "80 % of the range",
        "at 50 % speed",
        "3 repetitions with a pause of 1.5 s at each end",
    )
    assert asked.duration_s == pytest.approx(3 * 2 * motion.duration_s + 2 * 1.5)
    assert ranges(asked) == pytest.approx(0.8 * ranges(motion))
    playable(asked)


def test_same_settings_give_the_same_motion_to_the_last_digit() -> None:
    asked = PlaybackSettings(speed_percent=73.0, repetitions=3, pause_s=1.1, range_percent=67.0)
    motion = waves([0.7] * 5, [10.0] * 5, 4.0, 100)
    one, other = edit.with_settings(motion, asked), edit.with_settings(motion, asked)
    assert one.times_s.tobytes() == other.times_s.tobytes()
    assert one.angles_deg.tobytes() == other.angles_deg.tobytes()
