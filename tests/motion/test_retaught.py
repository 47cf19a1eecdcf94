"""A part of a motion that was taught again, blended into the motion at two marks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.device.config import simulated
from kata.motion.edit import EditError, Motion
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.method import reference
from kata.motion.retaught import MAX_GAP_DEG, retaught
from tests.support.rhythm_motions import evenly, times_of, wave

START_S, END_S = 2.0, 6.0


def motion(poses: Floats) -> Motion:
    return Motion(times_of(poses), motor_angles_deg(poses))


LIFT = motion(evenly(wave(15.0, 80.0, 8.0), 4.0))
AT_MARKS = LIFT.at(np.array([START_S, END_S]))


def new_part(lasts_s: float = 4.0, off_deg: float = 0.0, bump_deg: float = 8.0) -> Motion:
    """Return a part between the marks, whose motor 3 goes another way and begins and ends beside the marks."""
    x = np.linspace(0.0, 1.0, int(lasts_s * 100) + 1)[:, None]
    angles = AT_MARKS[0] + (AT_MARKS[1] - AT_MARKS[0]) * (3 * x**2 - 2 * x**3)
    angles = angles + np.array([0.0, 0.0, 1.0, 0.0, 0.0]) * (off_deg + bump_deg * np.sin(np.pi * x) ** 2)
    return Motion(x[:, 0] * lasts_s, angles)


@settings(max_examples=30, deadline=None)
@given(lasts_s=st.floats(2.0, 9.0), off_deg=st.floats(-10.0, 10.0))
def test_part_is_blended_at_both_marks_and_can_be_played(lasts_s: float, off_deg: float) -> None:
    part = new_part(round(lasts_s, 2), off_deg)
    made = retaught(LIFT, START_S, END_S, part, "Part")
    eases_s = 4 * 0.2
    assert made.duration_s <= LIFT.duration_s - (END_S - START_S) + part.duration_s + eases_s + 1e-6
    # The path outside the marks is the taught one.
    outside = made.times_s < START_S - 0.3
    assert made.angles_deg[outside] == pytest.approx(LIFT.at(made.times_s[outside]), abs=1e-6)
    last = made.duration_s - made.times_s
    outside = last < LIFT.duration_s - END_S - 0.3
    assert made.angles_deg[outside] == pytest.approx(LIFT.at(LIFT.duration_s - last[outside]), abs=1e-6)
    # It passes both marks, and nowhere jumps.
    for mark in AT_MARKS:
        assert np.abs(made.angles_deg - mark).max(axis=1).min() < 1e-6
    simulated("virtual").check_reference("smooth", reference("smooth", made.times_s, made.angles_deg), "right")


def test_middle_of_the_part_is_as_taught() -> None:
    part = new_part(6.0, off_deg=4.0)
    made = retaught(LIFT, START_S, END_S, part, "Part")
    top = part.angles_deg[300]
    assert np.abs(made.angles_deg - top).max(axis=1).min() < 1e-6


@pytest.mark.parametrize(("start_s", "end_s"), [(0.0, 4.0), (4.0, 8.0), (0.0, 8.0)])
def test_part_replaces_the_start_or_the_end_of_a_motion(start_s: float, end_s: float) -> None:
    within = (LIFT.times_s >= start_s) & (LIFT.times_s <= end_s)
    angles = LIFT.angles_deg[within] + np.array([0.0, 0.0, 3.0, 0.0, 0.0])
    made = retaught(LIFT, start_s, end_s, Motion(LIFT.times_s[within] - start_s, angles), "Part")
    assert made.angles_deg[[0, -1]] == pytest.approx(LIFT.angles_deg[[0, -1]], abs=1e-6)
    assert made.angles_deg[:, 2].max() <= LIFT.angles_deg[:, 2].max() + 3.0 + 1e-6


def test_edit_names_marks_and_part() -> None:
    assert retaught(LIFT, START_S, END_S, new_part(), "Part 2").done == ("2.0 s to 6.0 s taught again, Part 2",)


def test_part_far_from_a_mark_is_refused() -> None:
    with pytest.raises(EditError, match=r"motor 3 of the new part is 25° from the mark at 2\.0 s"):
        retaught(LIFT, START_S, END_S, new_part(off_deg=MAX_GAP_DEG + 5.0), "Part")


@pytest.mark.parametrize(("start_s", "end_s"), [(5.0, 5.2), (-1.0, 4.0), (4.0, 99.0), (6.0, 2.0)])
def test_marks_outside_the_motion_are_refused(start_s: float, end_s: float) -> None:
    with pytest.raises(EditError, match="must last at least"):
        retaught(LIFT, start_s, end_s, new_part(), "Part")
