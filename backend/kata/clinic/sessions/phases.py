"""Evaluate the phases of a run's journal: resistance, reduced range, and the angles reached with reduced range."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from kata.device.journal import PHASE_PAUSED, PHASE_REDUCED_RANGE, PHASE_REVERSING
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.linkage import Floats, OutOfReachError, pose_deg
from kata.motion.shoulder import rest_posture_deg

_FAR: Final = 0.7
"""Share of the way from rest to the far end beyond which ranges are compared. Nearer to rest, reduced and full range hardly differ."""


def reversals(phase: NDArray[np.uint8]) -> int:
    """Return how often resistance took the arm back."""
    return len(reversal_starts(phase))


def reversal_starts(phase: NDArray[np.generic]) -> NDArray[np.intp]:
    """Return the indices ``(r,)`` of the samples at which resistance began to take the arm back. A pause during the way back does not
    count as a new beginning.
    """
    counted = np.flatnonzero(phase != PHASE_PAUSED)
    is_reversing = phase[counted] == PHASE_REVERSING
    starts: NDArray[np.intp] = counted[np.diff(is_reversing.astype(np.int8), prepend=0) == 1]
    return starts


def least_range_percent(motion: Motion, phase: NDArray[np.uint8], path_s: Floats, measured_deg: Floats) -> float | None:
    """Return the smallest share of the requested range that was reached, in percent, or None if the range was not reduced.

    ``measured_deg`` ``(n, 5)`` is projected on the motion at the path positions ``path_s`` ``(n,)``, relative to the motion's rest posture.
    """
    lessened = phase == PHASE_REDUCED_RANGE
    if not np.any(lessened):
        return None
    rest_deg = rest_posture_deg(motion.angles_deg)
    requested_deg = motion.at(np.clip(path_s[lessened], 0.0, motion.duration_s)) - rest_deg
    went = measured_deg[lessened] - rest_deg
    requested_squared = np.sum(requested_deg**2, axis=1)
    far = requested_squared >= _FAR**2 * requested_squared.max()
    share = np.sum(requested_deg[far] * went[far], axis=1) / np.maximum(requested_squared[far], 1e-9)
    return float(np.clip(round(100 * float(share.min())), 0, 100))


def widen(
    motors: Sequence[dict[str, Any]], motions: Sequence[dict[str, Any]], lessened_deg: Floats, side: Side
) -> None:
    """Extend the reached angles by those that were reached with reduced range, ``lessened_deg`` ``(n, 5)``. The latter are not compared.

    ``motors`` and ``motions``: columns of the rows of motors and motions.
    """
    if len(lessened_deg) == 0:
        return
    for motor in motors:
        _widen(motor, lessened_deg[:, motor["motor"] - 1])
    if motions:
        try:
            poses = pose_deg(lessened_deg.astype(np.float64), side)
        except OutOfReachError:
            return
        for motion in motions:
            _widen(motion, poses[:, BASIC_MOTIONS[motion["motion"] - 1].axis - 1])


def _widen(columns: dict[str, Any], angles_deg: Floats) -> None:
    columns["played_min_deg"] = min(columns["played_min_deg"], float(angles_deg.min()))
    columns["played_max_deg"] = max(columns["played_max_deg"], float(angles_deg.max()))
