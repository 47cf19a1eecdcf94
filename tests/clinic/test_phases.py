"""Reversals and reduced range, read from the phases of a run."""

import numpy as np
import pytest

from kata.clinic.sessions.phases import least_range_percent, reversals, widen
from kata.device.journal import PHASE_PAUSED, PHASE_PLAYING, PHASE_REDUCED_RANGE, PHASE_RETURNING, PHASE_REVERSING
from kata.motion.edit import Motion
from kata.motion.linkage import motor_angles_deg

TIMES_S = np.linspace(0.0, 8.0, 801)
"""Two repetitions of 4 s."""
SWING = np.stack([20 * np.sin(np.pi * TIMES_S / 2), *[np.zeros_like(TIMES_S)] * 4], axis=1)
MOTION = Motion(TIMES_S, SWING)


@pytest.mark.parametrize(
    ("phases", "times"),
    [
        ([], 0),
        ([PHASE_PLAYING], 0),
        ([PHASE_PLAYING, PHASE_REVERSING, PHASE_PAUSED], 1),
        ([PHASE_PLAYING, PHASE_REVERSING, PHASE_PAUSED, PHASE_PLAYING, PHASE_REVERSING], 2),
        ([PHASE_PLAYING, PHASE_REVERSING, PHASE_PAUSED, PHASE_REVERSING, PHASE_RETURNING], 1),
    ],
)
def test_each_reversal_counts_once_however_it_is_paused(phases: list[int], times: int) -> None:
    assert reversals(np.repeat(np.array(phases, dtype=np.uint8), 3)) == times


def test_reduced_range_is_measured_by_the_way_really_moved() -> None:
    phase = np.where(TIMES_S < 4, PHASE_PLAYING, PHASE_REDUCED_RANGE).astype(np.uint8)
    share = np.where(TIMES_S < 4, 1.0, np.where(TIMES_S < 6, 0.8, 0.6))
    assert least_range_percent(MOTION, phase, TIMES_S, SWING * share[:, None]) == pytest.approx(60, abs=1)


def test_full_range_has_no_reduced_range_figure() -> None:
    assert least_range_percent(MOTION, np.full(801, PHASE_PLAYING, dtype=np.uint8), TIMES_S, SWING) is None


def test_reduced_motion_counts_as_reached() -> None:
    resting = motor_angles_deg(np.array([[0.0, 0.0, 10.0, 0.0, 0.0]]))[0]
    lifted = motor_angles_deg(np.array([[0.0, 0.0, 60.0, 0.0, 0.0]]))[0]
    motor = {"motor": 3, "played_min_deg": 9.0, "played_max_deg": 20.0}
    motion = {"motion": 4, "played_min_deg": 20.0, "played_max_deg": 30.0}
    widen([motor], [motion], np.stack([resting, lifted]), "right")
    assert [motor["played_min_deg"], motor["played_max_deg"]] == pytest.approx([9.0, float(lifted[2])])
    assert [motion["played_min_deg"], motion["played_max_deg"]] == pytest.approx([10.0, 60.0], abs=0.1)
    widen([motor], [], np.empty((0, 5)), "right")
    assert motor["played_min_deg"] == 9.0
