"""Learning a recording by repeating it: what was still missing last time is added the next (iterative learning control).

    c_{k+1} = Q[ (1 - leak) c_k + gain (1 + a1 D + a2 D^2) Q e_k ],        e_k = reference - measured,

on a grid of the recording's own clock, D being the derivative. The bracket before the error undoes the drives' lag, so that a
correction comes when it is needed and not a lag later; Q is a low-pass without a shift in time, above which the drives
follow too little to learn from; the leak forgets what is no longer confirmed. Bristow, Tharayil and Alleyne 2006, IEEE
Control Systems 26(3), Eq. 9 and the section on plant inversion.

What the patient did is not to be learned: nothing changes where the arm was stopped, paused or taken back, where a motor
worked hard, or near a limit.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats
from kata.motion.measured import Repetition
from kata.motion.method import Lag
from kata.motion.smoothing import smoothed
from kata.motion.trajectory import Trajectory

LARGEST_DEG: Final = 3.0
"""No correction is larger. Drives that need more are not the ones that were identified."""
STEP_S: Final = 0.02
_CUTOFF_HZ: Final = 4.0
_GAIN: Final = 0.6
_LEAK: Final = 0.02
_AROUND_S: Final = 1.0
"""So far around a disturbance nothing is learned: the arm has to find back."""
_FADE_S: Final = 0.5
"""From nothing learned to all of it."""
_NEAR_DEG: Final = 1.0
"""A setpoint so near a limit may have been held back by it."""
_SHARE_OF_THRESHOLD: Final = 0.5
"""Of the torque at which the patient's resistance turns the arm back; above it there may have been some."""
_RESISTS_S: Final = 0.1
"""A push shorter than this is none: the drives' own trembling is averaged out over so long."""
_LONGEST_GAP_S: Final = 0.1
"""Further from any sample nothing is known of the error."""


@dataclass(frozen=True)
class Correction:
    """What is added to a recording's setpoints: ``angles_deg`` is ``(m, 5)``, one row every ``step_s`` from 0."""

    step_s: float
    angles_deg: Floats

    def at(self, time_s: float) -> Floats:
        """The correction ``(5,)`` at a time, straight between two rows; before the first and after the last as there."""
        place = min(max(time_s / self.step_s, 0.0), len(self.angles_deg) - 1.0)
        row = min(int(place), len(self.angles_deg) - 2)
        share = place - row
        correction: Floats = (1 - share) * self.angles_deg[row] + share * self.angles_deg[row + 1]
        return correction


def learn(
    before: Correction | None,
    trajectory: Trajectory,
    repetition: Repetition,
    lag: Lag,
    threshold_nm: Floats,
    limits_deg: Floats,
) -> Correction:
    """The correction for the next repetition.

    :param before: the one that this repetition was played with; None for the first.
    :param threshold_nm: ``(5,)``: where the patient's resistance would have turned the arm back.
    :param limits_deg: ``(5, 2)``: lowest and highest setpoint of each axis.
    :raises ValueError: when nothing was played, or the correction is not as long as the recording.
    """
    # Imported here: the device process plays with corrections and never learns one.
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import uniform_filter1d

    grid = np.arange(rows(trajectory.duration_s), dtype=np.float64) * STEP_S
    had = before.angles_deg if before else np.zeros((len(grid), N_AXES))
    if had.shape != (len(grid), N_AXES) or (before and before.step_s != STEP_S):
        raise ValueError("the correction belongs to another recording")
    reference = trajectory.along(grid)
    repetition = _from_first_to_last(repetition)
    played_at, order = np.unique(repetition.path_s[repetition.playing], return_index=True)
    if len(played_at) < 2:
        raise ValueError("nothing was played")
    played = repetition.measured_deg[repetition.playing][order]
    error = reference - np.column_stack([np.interp(grid, played_at, axis) for axis in played.T])
    curve = CubicSpline(grid, smoothed(grid, error, _CUTOFF_HZ), bc_type="natural")
    missing = curve(grid) + lag.first_s * curve(grid, 1) + lag.second_s2 * curve(grid, 2)
    target = smoothed(grid, (1 - _LEAK) * had + _GAIN * missing, _CUTOFF_HZ)

    sample_s = float(np.median(np.diff(played_at)))
    torque = uniform_filter1d(repetition.torque_nm, max(1, round(_RESISTS_S / sample_s)), axis=0)
    hard = np.abs(torque) > _SHARE_OF_THRESHOLD * threshold_nm
    there = reference + had
    near = (there < limits_deg[:, 0] + _NEAR_DEG) | (there > limits_deg[:, 1] - _NEAR_DEG)
    undisturbed = _distance(grid, repetition.path_s[~repetition.playing])
    undisturbed[_distance(grid, played_at) > _LONGEST_GAP_S] = 0.0
    learned = had.copy()
    for axis in range(N_AXES):
        alone = np.minimum(undisturbed, _distance(grid, repetition.path_s[hard[:, axis]])) - _AROUND_S
        free = np.minimum(alone, _distance(grid, grid[near[:, axis]]))
        learned[:, axis] += np.clip(free / _FADE_S, 0.0, 1.0) * (target[:, axis] - had[:, axis])
    return Correction(STEP_S, np.clip(learned, -LARGEST_DEG, LARGEST_DEG))


def _from_first_to_last(repetition: Repetition) -> Repetition:
    """Waiting at the start, and what comes after the end, are no disturbances."""
    playing = np.flatnonzero(repetition.playing)
    during = slice(playing[0], playing[-1] + 1) if len(playing) else slice(0)
    return Repetition(
        repetition.path_s[during],
        repetition.measured_deg[during],
        repetition.torque_nm[during],
        repetition.playing[during],
    )


def rows(duration_s: float) -> int:
    """How many rows the correction of a recording has; never fewer than two."""
    return max(2, int(duration_s / STEP_S) + 1)


def _distance(grid: Floats, places: Floats) -> Floats:
    """From each place of the grid to the nearest of some others, in any order; infinite where there are none."""
    if len(places) == 0:
        return np.full(len(grid), np.inf)
    ordered = np.sort(places)
    after = np.minimum(np.searchsorted(ordered, grid), len(ordered) - 1)
    distance: Floats = np.minimum(np.abs(ordered[after] - grid), np.abs(ordered[np.maximum(after - 1, 0)] - grid))
    return distance
