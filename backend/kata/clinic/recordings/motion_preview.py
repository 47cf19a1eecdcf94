"""Motion data for the page's 3-D apparatus: few samples in real time."""

from typing import Final

import numpy as np
from pydantic import Field

from kata.motion.edit import Motion
from kata.motion.linkage import Floats
from kata.types import Schema, Side

_SAMPLE_PERIOD_S: Final = 0.05
_MAX_SAMPLES: Final = 3000


class MotionPreview(Schema):
    """Motor angles over time. They are linear between two samples."""

    side: Side
    times_s: list[float] = Field(description="Seconds, ascending; the first is 0, the last is the motion's duration.")
    angles_deg: list[list[float]] = Field(description="One row per time: motor angles in axis order 1-5, degrees.")


def motion_preview(motion: Motion, side: Side) -> MotionPreview:
    """Return a motion with 20 samples a second, or fewer for a motion longer than two and a half minutes."""
    times_s, angles_deg = resampled(motion.times_s, motion.angles_deg)
    return MotionPreview(side=side, times_s=times_s, angles_deg=angles_deg)


def resampled(times_s: Floats, angles_deg: Floats) -> tuple[list[float], list[list[float]]]:
    """Return equally spaced times and the angles interpolated at them: 20 samples a second, at most 3000 samples.

    :param times_s: ``(n,)``; the first is 0.
    :param angles_deg: ``(n, 5)``.
    """
    duration_s = float(times_s[-1])
    count = int(np.clip(np.ceil(duration_s / _SAMPLE_PERIOD_S) + 1, 2, _MAX_SAMPLES))
    shown_s = np.linspace(0.0, duration_s, count)
    columns = [np.interp(shown_s, times_s, angles) for angles in angles_deg.T]
    return np.round(shown_s, 3).tolist(), np.round(np.stack(columns, axis=-1), 2).tolist()
