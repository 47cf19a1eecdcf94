"""Iterative learning control: each repetition of a recording corrects the remaining error of the one before.

    c_{k+1} = Q[ (1 - leak) c_k + gain (1 + a1 D + a2 D^2) Q e_k ],        e_k = reference - measured,

on a grid of the recording's own clock; D is the derivative. The bracket before the error inverts the drives' lag, so
that a correction is not late by one lag. Q is a low-pass filter without phase shift; above its cut-off the drives
follow too little to learn from. The leak forgets corrections that are no longer confirmed. Bristow, Tharayil and
Alleyne 2006, IEEE Control Systems 26(3), Eq. 9 and the section on plant inversion.

The patient's own movement must not be learned: the correction does not change where the arm was stopped, paused or
taken back, where a motor was heavily loaded, or near a limit.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats
from kata.motion.measured import Repetition
from kata.motion.method import ServoModel
from kata.motion.smoothing import smoothed
from kata.motion.trajectory import Trajectory

MAX_CORRECTION_DEG: Final = 3.0
"""Limits each correction. Drives that need more are not the ones that were identified."""
STEP_S: Final = 0.02
_CUTOFF_HZ: Final = 4.0
_GAIN: Final = 0.6
_LEAK: Final = 0.02
_DISTURBANCE_MARGIN_S: Final = 1.0
"""Nothing is learned this close to a disturbance: the arm needs time to come back to its path."""
_FADE_IN_S: Final = 0.5
"""Transition from no learning to full learning."""
_LIMIT_MARGIN_DEG: Final = 1.0
"""A setpoint this close to a limit may have been held back by the limit."""
_MAX_TORQUE_SHARE: Final = 0.5
"""Share of the torque at which the patient's resistance takes the arm back; above it the patient may have resisted."""
_TORQUE_AVERAGE_S: Final = 0.1
"""Torque is averaged over this time: shorter pushes come from the drives' own vibration."""
_LONGEST_GAP_S: Final = 0.1
"""Further than this from any sample the error is unknown."""


@dataclass(frozen=True)
class Correction:
    """The correction added to a recording's setpoints: ``angles_deg`` is ``(m, 5)``, one row every ``step_s`` from 0."""

    step_s: float
    angles_deg: Floats

    def at(self, time_s: float) -> Floats:
        """Return the correction ``(5,)`` at a time, linear between two rows, constant before the first and after the
        last.
        """
        place = min(max(time_s / self.step_s, 0.0), len(self.angles_deg) - 1.0)
        row = min(int(place), len(self.angles_deg) - 2)
        share = place - row
        correction: Floats = (1 - share) * self.angles_deg[row] + share * self.angles_deg[row + 1]
        return correction


def next_correction(
    before: Correction | None,
    trajectory: Trajectory,
    repetition: Repetition,
    servo_model: ServoModel,
    threshold_nm: Floats,
    limits_deg: Floats,
) -> Correction:
    """Return the correction for the next repetition.

    :param before: the correction that this repetition was played with; None for the first.
    :param threshold_nm: ``(5,)``: the torque at which the patient's resistance takes the arm back.
    :param limits_deg: ``(5, 2)``: lowest and highest setpoint of each axis.
    :raises ValueError: when nothing was played, or the correction is not as long as the recording.
    """
    # Imported here: the device process plays with corrections and never learns one.
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import uniform_filter1d

    grid = np.arange(rows(trajectory.duration_s), dtype=np.float64) * STEP_S
    previous = before.angles_deg if before else np.zeros((len(grid), N_AXES))
    if previous.shape != (len(grid), N_AXES) or (before and before.step_s != STEP_S):
        raise ValueError("the correction belongs to another recording")
    reference = trajectory.along(grid)
    repetition = _from_first_to_last(repetition)
    played_at, order = np.unique(repetition.path_s[repetition.playing], return_index=True)
    if len(played_at) < 2:
        raise ValueError("nothing was played")
    played = repetition.measured_deg[repetition.playing][order]
    error = reference - np.column_stack([np.interp(grid, played_at, axis) for axis in played.T])
    curve = CubicSpline(grid, smoothed(grid, error, _CUTOFF_HZ), bc_type="natural")
    missing = curve(grid) + servo_model.first_s * curve(grid, 1) + servo_model.second_s2 * curve(grid, 2)
    target = smoothed(grid, (1 - _LEAK) * previous + _GAIN * missing, _CUTOFF_HZ)

    sample_s = float(np.median(np.diff(played_at)))
    torque = uniform_filter1d(repetition.torque_nm, max(1, round(_TORQUE_AVERAGE_S / sample_s)), axis=0)
    loaded = np.abs(torque) > _MAX_TORQUE_SHARE * threshold_nm
    there = reference + previous
    near = (there < limits_deg[:, 0] + _LIMIT_MARGIN_DEG) | (there > limits_deg[:, 1] - _LIMIT_MARGIN_DEG)
    undisturbed = _distance(grid, repetition.path_s[~repetition.playing])
    undisturbed[_distance(grid, played_at) > _LONGEST_GAP_S] = 0.0
    learned = previous.copy()
    for axis in range(N_AXES):
        alone = np.minimum(undisturbed, _distance(grid, repetition.path_s[loaded[:, axis]])) - _DISTURBANCE_MARGIN_S
        free = np.minimum(alone, _distance(grid, grid[near[:, axis]]))
        learned[:, axis] += np.clip(free / _FADE_IN_S, 0.0, 1.0) * (target[:, axis] - previous[:, axis])
    return Correction(STEP_S, np.clip(learned, -MAX_CORRECTION_DEG, MAX_CORRECTION_DEG))


def _from_first_to_last(repetition: Repetition) -> Repetition:
    """Return the samples from the first to the last playing one: waiting at the start and samples after the end are no
    disturbances.
    """
    playing = np.flatnonzero(repetition.playing)
    during = slice(playing[0], playing[-1] + 1) if len(playing) else slice(0)
    return Repetition(
        repetition.path_s[during],
        repetition.measured_deg[during],
        repetition.torque_nm[during],
        repetition.playing[during],
    )


def rows(duration_s: float) -> int:
    """Return the number of rows of a recording's correction; at least two."""
    return max(2, int(duration_s / STEP_S) + 1)


def _distance(grid: Floats, places: Floats) -> Floats:
    """Return the distance from each place of the grid to the nearest of ``places``, in any order; infinite if there are
    none.
    """
    if len(places) == 0:
        return np.full(len(grid), np.inf)
    ordered = np.sort(places)
    after = np.minimum(np.searchsorted(ordered, grid), len(ordered) - 1)
    distance: Floats = np.minimum(np.abs(ordered[after] - grid), np.abs(ordered[np.maximum(after - 1, 0)] - grid))
    return distance
