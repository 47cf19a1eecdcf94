"""The motion that the page's 3-D apparatus shows before a playback."""

import numpy as np
import pytest

from kata.clinic.recordings.motion_preview import motion_preview
from kata.motion.edit import Motion


def _motion(duration_s: float, rate_hz: int) -> Motion:
    times_s = np.linspace(0.0, duration_s, int(duration_s * rate_hz) + 1)
    return Motion(times_s, np.stack([np.sin(times_s) * (axis + 1) for axis in range(5)], axis=-1))


def test_preview_keeps_the_motions_time_and_path() -> None:
    motion = _motion(7.31, 100)
    seen = motion_preview(motion, "left")
    assert (seen.side, seen.times_s[0], seen.times_s[-1]) == ("left", 0.0, 7.31)
    for time_s, row in zip(seen.times_s, seen.angles_deg, strict=True):
        assert row == pytest.approx([np.sin(time_s) * (axis + 1) for axis in range(5)], abs=0.02)


def test_preview_has_twenty_samples_a_second_and_a_bounded_size() -> None:
    assert np.diff(motion_preview(_motion(7.31, 100), "left").times_s).max() <= 0.051
    hour = motion_preview(_motion(3600.0, 10), "right")
    assert len(hour.times_s) == len(hour.angles_deg) == 3000
