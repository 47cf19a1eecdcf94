"""Reduces samples to a number that can be drawn at once. Peaks are preserved.

A line is divided into 499 sections and keeps the lowest and highest value of each. On a screen of two thousand pixels a section is about
four pixels wide, so the line looks almost the same as with all samples. For a long recording or run these points are computed when it is
stored, so that its full figure needs no samples.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from tsdownsample import MinMaxDownsampler

from kata.database.arrays import Floats, SampleColumn, encode
from kata.database.series import BLOCK_SAMPLES
from kata.motion.axes import N_AXES
from kata.motion.edit import Motion
from kata.motion.tracking import Comparison

LINE_POINTS: Final = 1000
"""Number of points of a line: the lowest and highest value of 499 sections, and both ends."""
_MINMAX: Final = MinMaxDownsampler()  # type: ignore[no-untyped-call]
Lines = dict[str, Floats]
"""Lines by name. ``..._s`` and ``..._deg`` are ``(k, 5)``, with one column for each motor. Each column has its own points."""

_RECORDING_COLUMNS: Final = (SampleColumn("taught_s", "s", 1e-3), SampleColumn("taught_deg", "deg", 1e-3))
_RUN_COLUMNS: Final = (
    *_RECORDING_COLUMNS,
    SampleColumn("played_s", "s", 1e-3),
    SampleColumn("played_deg", "deg", 1e-3),
    SampleColumn("error_deg", "deg", 1e-3),
)


def of_recording(times_s: Floats, angles_deg: Floats) -> bytes | None:
    """Return the lines to be stored with a recording; None if it is short enough to be drawn from its samples."""
    return encode(recording_lines(times_s, angles_deg), _RECORDING_COLUMNS) if len(times_s) > BLOCK_SAMPLES else None


def of_run(motion: Motion, compared: Comparison) -> bytes | None:
    """Return the lines to be stored with a run; None if it is short enough to be drawn from its samples."""
    if compared.samples <= BLOCK_SAMPLES:
        return None
    return encode(run_lines(motion, compared.times_s, compared.played_deg, compared.error_deg), _RUN_COLUMNS)


def recording_lines(times_s: Floats, angles_deg: Floats) -> Lines:
    """Return the lines ``taught_s`` and ``taught_deg``: angles over time."""
    chosen = _chosen_points(angles_deg)
    return {"taught_s": times_s[chosen], "taught_deg": np.take_along_axis(angles_deg, chosen, axis=0)}


def run_lines(motion: Motion, clock_s: Floats, played_deg: Floats, error_deg: Floats) -> Lines:
    """Return the lines of the requested motion, and those of the playback and of the error at the times ``clock_s`` ``(m,)``,
    which are path times or wall times. Playback and error have the same points.
    """
    chosen = _chosen_points(played_deg, error_deg)
    return recording_lines(motion.times_s, motion.angles_deg) | {
        "played_s": clock_s[chosen],
        "played_deg": np.take_along_axis(played_deg, chosen, axis=0),
        "error_deg": np.take_along_axis(error_deg, chosen, axis=0),
    }


def _chosen_points(*lines_deg: Floats) -> NDArray[np.intp]:
    """Return the union of the points that are chosen for each line: ``(k, 5)`` indices in ascending order."""
    count = len(lines_deg[0])
    if count <= LINE_POINTS * len(lines_deg):
        return np.repeat(np.arange(count)[:, None], N_AXES, axis=1)
    columns = [
        np.sort(np.concatenate([_extremes(np.ascontiguousarray(line[:, axis])) for line in lines_deg]))
        for axis in range(N_AXES)
    ]
    return np.stack(columns, axis=1)


def _extremes(values: Floats) -> NDArray[np.intp]:
    """Return the first and last index, and those of the lowest and highest value of each section. Their number is the same for
    every axis.
    """
    inner = _MINMAX.downsample(values, n_out=LINE_POINTS - 2)
    return np.concatenate([[0], inner.astype(np.intp), [len(values) - 1]])
