"""Motion data for the page's 3-D apparatus: few samples, in real time."""

from typing import Final

import numpy as np
from pydantic import Field

from kata.motion.edit import Motion
from kata.types import Schema, Side

_STEP_S: Final = 0.05
_MOST: Final = 3000


class MotionPreview(Schema):
    """Motor angles over time, linear between two samples."""

    side: Side
    times_s: list[float] = Field(description="Seconds, ascending; the first is 0, the last the motion's duration.")
    angles_deg: list[list[float]] = Field(description="One row per time: motor angles in axis order 1-5, degrees.")


def motion_preview(motion: Motion, side: Side) -> MotionPreview:
    """Return a motion at 20 samples a second; fewer for a motion longer than two and a half minutes."""
    count = int(np.clip(np.ceil(motion.duration_s / _STEP_S) + 1, 2, _MOST))
    times_s = np.linspace(0.0, motion.duration_s, count)
    columns = [np.interp(times_s, motion.times_s, angles) for angles in motion.angles_deg.T]
    return MotionPreview(
        side=side,
        times_s=np.round(times_s, 3).tolist(),
        angles_deg=np.round(np.stack(columns, axis=-1), 2).tolist(),
    )
