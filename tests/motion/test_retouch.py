"""A retouch changes a part of a motion smoothly, and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.motion.builtin import built_in_motions
from kata.motion.edit import EditError, Motion
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.retouch import POINT_GAP_S, ChangePoint, change_deg, retouched


def built_in(number: int) -> Motion:
    taught = built_in_motions()[number - 1]
    return Motion(taught.times_s, motor_angles_deg(taught.poses_deg))


MOTION = built_in(4)


def knots(gaps_s: list[float], changes_deg: list[float]) -> tuple[Floats, Floats]:
    """Return marks and points: times ``(k,)`` and changes ``(k,)``, which are 0 at both ends."""
    inner = min(len(gaps_s) - 1, len(changes_deg))
    return np.concatenate([[1.0], 1.0 + np.cumsum(gaps_s[: inner + 1])]), np.array([0.0, *changes_deg[:inner], 0.0])


curves = st.builds(
    knots,
    st.lists(st.floats(POINT_GAP_S, 3.0), min_size=2, max_size=8),
    st.lists(st.floats(-30.0, 30.0), min_size=1, max_size=7),
)


@settings(max_examples=100)
@given(curves)
def test_change_passes_its_points_and_never_overshoots(curve: tuple[Floats, Floats]) -> None:
    times, changes = curve
    assert change_deg(times, changes, times) == pytest.approx(changes, abs=1e-9)
    for n in range(len(times) - 1):
        piece = change_deg(times, changes, np.linspace(times[n], times[n + 1], 50))
        low, high = sorted(changes[n : n + 2])
        assert piece.min() >= low - 1e-9
        assert piece.max() <= high + 1e-9


@settings(max_examples=100)
@given(curves)
def test_change_is_smooth_at_marks_and_points(curve: tuple[Floats, Floats]) -> None:
    times, changes = curve
    step = 1e-4
    largest = float(np.abs(changes).max())

    def at(times_s: Floats) -> Floats:
        inside = change_deg(times, changes, np.clip(times_s, times[0], times[-1]))
        return np.where((times_s < times[0]) | (times_s > times[-1]), 0.0, inside)

    left, middle, right = at(times - step), at(times), at(times + step)
    # Both sides of a knot have the same slope and no curvature: the differences vanish with the third power of the step.
    jerk = 60 * 2 * largest / POINT_GAP_S**3
    assert np.abs(left - 2 * middle + right).max() <= 2 * jerk * step**3 + 1e-9


@settings(max_examples=40)
@given(st.floats(0.0, 0.4), st.floats(0.6, 1.0), st.floats(-20.0, 20.0))
def test_nothing_changes_outside_marks_or_in_other_motors(start: float, end: float, deg: float) -> None:
    start_s, end_s = start * MOTION.duration_s, end * MOTION.duration_s
    middle_s = (start_s + end_s) / 2
    made = retouched(MOTION, start_s, end_s, [ChangePoint(3, middle_s, deg)])
    difference = made.angles_deg - MOTION.angles_deg
    outside = (MOTION.times_s <= start_s) | (MOTION.times_s >= end_s)
    assert not difference[outside].any()
    assert not difference[:, [0, 1, 3, 4]].any()
    assert (made.times_s == MOTION.times_s).all()
    assert np.interp(middle_s, made.times_s, difference[:, 2]) == pytest.approx(deg, abs=0.2)


def test_retouch_names_motors_largest_change_and_marks() -> None:
    one = retouched(MOTION, 1.0, 3.0, [ChangePoint(3, 1.5, 2.0), ChangePoint(3, 2.0, -5.0)])
    assert one.done == ("motor 3 changed by up to -5.0° between 1.0 s and 3.0 s",)
    two = retouched(MOTION, 1.0, 3.0, [ChangePoint(4, 1.5, 2.0), ChangePoint(3, 1.5, 1.0)])
    assert two.done == ("motors 3, 4 changed by up to 2.0° between 1.0 s and 3.0 s",)


def test_shortest_part_is_accepted_despite_rounding() -> None:
    assert 2 * POINT_GAP_S > 4.8 - 4.4
    assert retouched(MOTION, 4.4, 4.8, [ChangePoint(3, 4.6, 1.0)]).done


@pytest.mark.parametrize(
    ("marks_s", "points", "reason"),
    [
        ((1.0, 99.0), [ChangePoint(3, 2.0, 1.0)], "within the motion"),
        ((1.0, 1.3), [ChangePoint(3, 1.2, 1.0)], "at least 0.4 s"),
        ((1.0, 3.0), [ChangePoint(3, 2.0, 1.0), ChangePoint(3, 2.1, 1.0)], "motor 3 at 2.0 s and 2.1 s"),
        ((1.0, 3.0), [ChangePoint(3, 3.5, 1.0)], "between the marks"),
        ((1.0, 3.0), [ChangePoint(3, 0.5, 1.0)], "between the marks"),
        ((1.0, 3.0), [], "at least one of motors"),
    ],
)
def test_impossible_points_and_marks_are_refused(
    marks_s: tuple[float, float], points: list[ChangePoint], reason: str
) -> None:
    with pytest.raises(EditError, match=reason):
        retouched(MOTION, *marks_s, points)
