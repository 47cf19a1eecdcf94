"""Implements iterative learning control: each repetition of a recording corrects the remaining error of the one before.

    c_{k+1} = Q[ (1 - leak) c_k + gain (1 + H (a1 D + a2 D^2)) Q e_k ],        e_k = reference - measured,

on a grid of the recording's own clock. D is the derivative. H is the share of a lag that remains after the drives' integral
has reacted (:class:`~kata.motion.method.ServoModel`). The bracket before the error inverts the drives' lag, so that a
correction is not late by this lag. Q is a low-pass filter without phase shift. Above its cut-off the drives follow too little
for learning. The leak removes corrections that are no longer confirmed. Source: Bristow, Tharayil and Alleyne 2006, IEEE
Control Systems 26(3), Eq. 9 and the section on plant inversion.

Learning must not make the error grow. If the RMS or the peak of an axis' error is clearly larger than ever before, the drive differs from
the identified model. The axis falls back to its correction in the best repetition, and its gain is halved (:class:`LearnedRepetition`). One
arm couples the axes: if the error has grown although the axis had nearly this correction, the correction of another axis has caused it, and all
axes fall back. If all axes had nearly the corrections of the best repetition, the arm has changed, and this repetition counts as the best.

The patient's own movement must not be learned. The correction therefore does not change at places where the arm was stopped,
paused or moved back, where a motor was heavily loaded, or near a limit. Where one motor has little torque left, no axis learns: the
correction of another can take this torque.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats
from kata.motion.measured import Repetition
from kata.motion.method import ServoModel, after_integral
from kata.motion.smoothing import natural_derivatives, smoothed
from kata.motion.trajectory import Trajectory

MAX_CORRECTION_DEG: Final = 3.0
"""Largest correction. Drives that need more differ from the identified model."""
STEP_S: Final = 0.02
_CUTOFF_HZ: Final = 4.0
_GAIN: Final = 0.6
_LEAK: Final = 0.02
_GROWN_ERROR_RATIO: Final = 1.1
"""An error has grown if it exceeds this multiple of the smallest error plus its noise. Smaller changes come from muscle tone."""
_RMS_NOISE_DEG: Final = 0.02
_PEAK_NOISE_DEG: Final = 0.05
_SAME_CORRECTION_DEG: Final = 0.01
"""A smaller change of an axis' correction does not make its error grow."""
_START_S: Final = 1.0
"""Errors count from this time on. Before, they depend on where the arm was put."""
_LEAST_FREE_SHARE: Final = 0.3
"""Smallest undisturbed share of a repetition whose error can be compared with that of another."""
_DISTURBANCE_MARGIN_S: Final = 1.0
"""Nothing is learned this close to a disturbance, because the arm needs time to return to its path."""
_FADE_IN_S: Final = 0.5
"""Transition from no learning to full learning."""
_LIMIT_MARGIN_DEG: Final = 1.0
"""Nothing is learned this close to a limit, because the limit may have held the setpoint back."""
_DISTURBED_TORQUE_SHARE: Final = 0.5
"""Above this share of the resistance threshold a sample counts as disturbed, because the patient may have resisted."""
_STRAINED_TORQUE_SHARE: Final = 0.85
"""Above this share of the resistance threshold a motor has little torque left. A motion that is predicted to need it is refused."""
_TORQUE_AVERAGE_S: Final = 0.1
"""Torque is averaged over this time, because shorter pushes come from the drives' own vibration."""
_LONGEST_GAP_S: Final = 0.1
"""The error is unknown at places farther than this from any sample."""


@dataclass(frozen=True)
class LearnedRepetition:
    """The best repetition so far, and the smallest errors of each axis, with which the next repetition is compared."""

    played_deg: Floats
    """``(m, 5)``: the correction that the best repetition was played with."""
    total_deg: float
    """RMS error of all axes in the best repetition; NaN if no axis had enough undisturbed time."""
    error_deg: Floats
    """``(5,)``: smallest RMS error; NaN for an axis with too little undisturbed time."""
    peak_deg: Floats
    """``(5,)``: smallest peak of the smoothed error, also where the arm was loaded; NaN if nothing was undisturbed."""
    gain: Floats
    """``(5,)``: share of the error that is corrected in each repetition."""
    fell_back: tuple[int, ...] = ()
    """Motors (1-5) that use the correction of the best repetition again."""

    def compared_with(self, repetition: "LearnedRepetition") -> "LearnedRepetition":
        """Return what counts after another repetition."""
        own = np.abs(repetition.played_deg - self.played_deg).max(axis=0) > _SAME_CORRECTION_DEG
        grown = (repetition.error_deg > _GROWN_ERROR_RATIO * self.error_deg + _RMS_NOISE_DEG) | (
            repetition.peak_deg > _GROWN_ERROR_RATIO * self.peak_deg + _PEAK_NOISE_DEG
        )
        if grown.any() and not own.any():
            return replace(repetition, gain=self.gain)
        if grown.any():
            back = np.ones(N_AXES, dtype=bool) if (grown & ~own).any() else grown
            motors = tuple(int(axis) + 1 for axis in np.flatnonzero(back))
            return replace(self, gain=np.where(back, self.gain / 2, self.gain), fell_back=motors)
        best = repetition if repetition.total_deg <= self.total_deg or np.isnan(self.total_deg) else self
        return LearnedRepetition(
            best.played_deg,
            best.total_deg,
            np.fmin(self.error_deg, repetition.error_deg),
            np.fmin(self.peak_deg, repetition.peak_deg),
            self.gain,
        )


@dataclass(frozen=True)
class Correction:
    """The correction added to a recording's setpoints: ``angles_deg`` is ``(m, 5)``, one row every ``step_s`` from 0."""

    step_s: float
    angles_deg: Floats
    learned_from: LearnedRepetition | None = None
    """The repetition from which the correction was learned; None if unknown."""

    def at(self, time_s: float) -> Floats:
        """Return the correction ``(5,)`` at a time. It is linear between two rows, and constant before the first and after the
        last row.
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
    :param threshold_nm: ``(5,)``: the torque that counts as the patient's resistance.
    :param limits_deg: ``(5, 2)``: lowest and highest setpoint of each axis.
    :raises ValueError: when no samples were played, or the correction is not as long as the recording.
    """
    grid = np.arange(rows(trajectory.duration_s), dtype=np.float64) * STEP_S
    previous = before.angles_deg if before else np.zeros((len(grid), N_AXES))
    if previous.shape != (len(grid), N_AXES) or (before and before.step_s != STEP_S):
        raise ValueError("the correction belongs to another recording")
    reference = trajectory.along(grid)
    repetition = _from_first_to_last(repetition)
    played_at, measured = _played(repetition, grid)
    error = reference - measured
    smooth_error = smoothed(grid, error, _CUTOFF_HZ)
    speed, acceleration = natural_derivatives(grid, smooth_error)
    lag = servo_model.first_s * speed + servo_model.second_s2 * acceleration
    missing = smooth_error + after_integral(lag, servo_model.integrated_share(STEP_S))
    earlier = before.learned_from if before else None
    gain = earlier.gain if earlier else np.full(N_AXES, _GAIN)
    target = smoothed(grid, (1 - _LEAK) * previous + gain * missing, _CUTOFF_HZ)

    expected_nm = servo_model.load.torque_nm(trajectory.motions(repetition.path_s))
    loaded = _exceeds(_DISTURBED_TORQUE_SHARE * threshold_nm, repetition.torque_nm - expected_nm, played_at)
    strained = _exceeds(_STRAINED_TORQUE_SHARE * threshold_nm, repetition.torque_nm, played_at).any(axis=1)
    corrected = reference + previous
    near = (corrected < limits_deg[:, 0] + _LIMIT_MARGIN_DEG) | (corrected > limits_deg[:, 1] - _LIMIT_MARGIN_DEG)
    undisturbed = _distance(grid, repetition.path_s[~repetition.playing])
    undisturbed[_distance(grid, played_at) > _LONGEST_GAP_S] = 0.0
    started = grid >= _START_S
    peak_counts = started & (undisturbed > _DISTURBANCE_MARGIN_S)
    peaks = np.abs(smooth_error[peak_counts]).max(axis=0) if peak_counts.any() else np.full(N_AXES, np.nan)
    undisturbed = np.minimum(undisturbed, _distance(grid, repetition.path_s[strained]))
    learned, error_rms = previous.copy(), np.full(N_AXES, np.nan)
    for axis in range(N_AXES):
        alone = np.minimum(undisturbed, _distance(grid, repetition.path_s[loaded[:, axis]])) - _DISTURBANCE_MARGIN_S
        free = np.minimum(alone, _distance(grid, grid[near[:, axis]]))
        counts = started & (free > 0.0)
        if np.mean(counts) >= _LEAST_FREE_SHARE:
            error_rms[axis] = np.sqrt(np.mean(error[counts, axis] ** 2))
        learned[:, axis] += np.clip(free / _FADE_IN_S, 0.0, 1.0) * (target[:, axis] - previous[:, axis])
    total = np.sqrt(np.mean(error_rms[np.isfinite(error_rms)] ** 2)) if np.isfinite(error_rms).any() else np.nan
    learned_from = LearnedRepetition(previous, float(total), error_rms, peaks, gain)
    if earlier:
        learned_from = earlier.compared_with(learned_from)
    for motor in learned_from.fell_back:
        learned[:, motor - 1] = learned_from.played_deg[:, motor - 1]
    return Correction(STEP_S, np.clip(learned, -MAX_CORRECTION_DEG, MAX_CORRECTION_DEG), learned_from)


def _played(repetition: Repetition, grid: Floats) -> tuple[Floats, Floats]:
    """Return the places that were played, ``(p,)``, and the measured angles on the grid, ``(m, 5)``.

    :raises ValueError: when no samples were played.
    """
    played_at, order = np.unique(repetition.path_s[repetition.playing], return_index=True)
    if len(played_at) < 2:
        raise ValueError("nothing was played")
    played = repetition.measured_deg[repetition.playing][order]
    return played_at, np.column_stack([np.interp(grid, played_at, axis) for axis in played.T])


def _exceeds(limit_nm: Floats, torque_nm: Floats, played_at: Floats) -> NDArray[np.bool_]:
    """Return True, ``(k, 5)``, where the averaged size of a motor's torque exceeds its limit ``(5,)``."""
    sample_s = float(np.median(np.diff(played_at)))
    samples = max(1, round(_TORQUE_AVERAGE_S / sample_s))
    around = np.pad(torque_nm, ((samples // 2, (samples - 1) // 2), (0, 0)), mode="symmetric")
    averaged = sliding_window_view(around, samples, axis=0).mean(axis=-1)
    over: NDArray[np.bool_] = np.abs(averaged) > limit_nm
    return over


def _from_first_to_last(repetition: Repetition) -> Repetition:
    """Return the samples from the first to the last playing sample. Waiting at the start and samples after the end are not
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
    """Return the distance from each place of the grid to the nearest of ``places`` (in any order). It is infinite if
    ``places`` is empty.
    """
    if len(places) == 0:
        return np.full(len(grid), np.inf)
    ordered = np.sort(places)
    after = np.minimum(np.searchsorted(ordered, grid), len(ordered) - 1)
    distance: Floats = np.minimum(np.abs(ordered[after] - grid), np.abs(ordered[np.maximum(after - 1, 0)] - grid))
    return distance
