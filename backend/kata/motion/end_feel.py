"""The end-feel of a shoulder: passive range, onset of resistance, stiffness and hysteresis from slow ways out and back.

Friction, muscle tone and the capsule's viscosity oppose movement, so they cancel on the mean of the way out and the way back. Weight and
elastic torque remain. A baseline with a test weight instead of an arm measures the apparatus' part of the weight at every place. The
arm differs from the test weight by two moments, whose torques are known functions of posture (:mod:`kata.motion.rigid_body`). The moments are
fitted where the shoulder is free. docs/explanation/end-feel.md has definitions, reasons and figures.

Outward angles and torques are positive away from rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from kata.motion.axes import Side
from kata.motion.edit import Motion
from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.rigid_body import arm_motion

MOTORS: Final = (3, 4, 5)
"""Motors of the shoulder joint: abduction, flexion and rotation."""
STRETCH_REPETITIONS: Final = 3
"""Usual number of a stretch. A test always has those of :class:`kata.device.ipc_messages.EndFeel`."""
SPEED_DEG_S: Final = 5.0
SLOWEST_DEG_S: Final = 2.0
FASTEST_DEG_S: Final = 10.0
"""Range of a test's speed. At lower speed the arm sticks and slips. At higher speed it turns too late."""
STATED_SHARE: Final = 0.6
"""The range is stated at this share of the chosen torque, because both the way out and the way back must pass the place."""
ONSET_SHARE: Final = 0.25
"""The onset of resistance is at this share of the chosen torque."""
TURN_DEG: Final = 1.5
"""The way back counts from this far after a turn. Friction changes its sign there, and play and soft tissue are reloaded. The way out has no
such part: it counts up to the turn."""
PLACE_DEG: Final = 0.5
"""Distance of a curve's places. A stiff capsule gains 0.4 Nm in 1 deg."""
START_DEG: Final = 3.0
"""Curves begin this much after the start, where the arm gains speed."""
DISAGREEMENT_NM: Final = 0.2
"""Largest difference of a relaxed patient's repetitions: RMS over :data:`_SPAN_PLACES` of a way."""
_SPAN_PLACES: Final = 12
_SMOOTH_PLACES: Final = 13
"""An encoder's count of 0.09 deg makes a position loop give 0.25 Nm more or less."""
_BASELINE_PLACES: Final = 41
"""A baseline is one way out and back, so its noise enters every repetition alike. Its weight and friction change slowly."""
_LEAST_SAMPLES: Final = 3
_HELD_PLACES: Final = 6
"""Number of places before the turn whose mean opposing torque is used near the turn."""
_MOMENT_PRIOR_NM: Final = 0.9
"""Regularises the arm's moments towards those of the test weight, as the device does (:mod:`kata.device.end_feel`)."""
_CUFF_NM_DEG: Final = 3.1
"""Stiffness of cuff and soft tissue between fixers and humerus: 4.5 N/mm across an upper arm (median of 21 subjects; Schiebl et al. 2025, Sensors 25,
4605), 0.2 m from the joint, which is our assumption. About the arm's own axis a cuff is softer, but the forearm is fixed too.
"""
_STIFFEST_SHARE: Final = 0.8
"""Share of the cuff's stiffness up to which a shoulder behind it can be measured."""
_T_95: Final = {2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776}
"""Student's t of a two-sided interval of 95 %, by the number of values."""
_PATH_STEP_S: Final = 0.02
_SHORTEST_S: Final = 1.0
"""A shorter way, in the path's time, is ignored."""
_POINTS: Final = 31
"""Points of the straight line through a part of the curve."""

Unmeasured = Literal["arm_not_weighed", "torque_not_reached", "resistance_from_start"]


class GuardingError(ValueError):
    """The repetitions do not agree: the patient worked with or against the apparatus."""

    def __init__(self, disagreement_nm: float) -> None:
        super().__init__(f"the repetitions differ by {disagreement_nm:.2f} Nm")
        self.disagreement_nm = disagreement_nm


class TooFewWaysError(ValueError):
    """There are fewer than two complete repetitions."""


@dataclass(frozen=True)
class TorqueAngleCurve:
    """Outward torque of one repetition, or the mean of several, at outward angles :data:`PLACE_DEG` apart: ``(n,)`` each."""

    places_deg: Floats
    out_nm: Floats
    back_nm: Floats
    """NaN in the part after the turn that is left out, until :meth:`completed`."""

    @property
    def mean_nm(self) -> Floats:
        """Mean torque of both ways. Torque that opposes movement cancels."""
        mean: Floats = (self.out_nm + self.back_nm) / 2
        return mean

    @property
    def opposing_nm(self) -> Floats:
        """Torque that opposes movement: half of the difference of both ways."""
        half: Floats = (self.out_nm - self.back_nm) / 2
        return half

    @property
    def returned(self) -> NDArray[np.bool_]:
        """True at each place that the way back has."""
        return ~np.isnan(self.back_nm)

    def completed(self) -> "TorqueAngleCurve":
        """Return the curve with the way back completed up to the turn, with the opposing torque of the last known places."""
        known = self.returned
        if np.all(known) or not np.any(known):
            return self
        held_nm = np.mean(self.opposing_nm[known][-_HELD_PLACES:])
        return TorqueAngleCurve(self.places_deg, self.out_nm, np.where(known, self.back_nm, self.out_nm - 2 * held_nm))

    def between(self, low_deg: float, high_deg: float) -> "TorqueAngleCurve":
        """Return the part of the curve between two angles."""
        inside = (self.places_deg >= low_deg) & (self.places_deg <= high_deg)
        return TorqueAngleCurve(self.places_deg[inside], self.out_nm[inside], self.back_nm[inside])


class Figures(NamedTuple):
    """Figures of a curve; also half the widths of their intervals."""

    range_deg: float
    """Outward angle at the stated torque."""
    onset_deg: float
    """Outward angle at which resistance begins."""
    stiffness_nm_deg: float
    """Slope of the straight line from onset to range."""
    last_third_nm_deg: float
    """The same over the last third of that way."""
    hysteresis_nm: float
    """Mean difference of way out and way back between onset and range, without the apparatus' friction."""


@dataclass(frozen=True)
class EndFeelResult:
    """The result of one test."""

    stated_nm: float
    onset_nm: float
    figures: Figures | None
    """Means of the repetitions; None if :attr:`unmeasured` says why not."""
    interval: Figures | None
    """Half of the width of their 95 % intervals."""
    unmeasured: Unmeasured | None
    curve: TorqueAngleCurve
    """Mean of the repetitions without the weight: its mean is the elastic torque."""
    disagreement_nm: float


def way_out(motion: Motion, speed_deg_s: float, further_deg: float = 0.0) -> tuple[Motion, int]:
    """Return a recorded motion from its start to its farthest place at constant speed, and the motor that is measured.

    That motor is the one of :data:`MOTORS` with the largest range. The other motors follow its angle as recorded. It alone moves
    ``further_deg`` beyond the recorded end.
    """
    axis = max(MOTORS, key=lambda motor: float(np.ptp(motion.angles_deg[:, motor - 1]))) - 1
    distance_deg = np.abs(motion.angles_deg[:, axis] - motion.angles_deg[0, axis])
    top = int(np.argmax(distance_deg))
    outward = np.sign(motion.angles_deg[top, axis] - motion.angles_deg[0, axis])
    # A guiding hand strays back by parts of a degree. The way out must not.
    reached = np.maximum.accumulate(outward * (motion.angles_deg[: top + 1, axis] - motion.angles_deg[0, axis]))
    new = np.concatenate([[True], np.diff(reached) > 0])
    whole_deg = float(reached[-1]) + further_deg
    times = np.linspace(0.0, whole_deg / speed_deg_s, max(2, round(whole_deg / speed_deg_s / _PATH_STEP_S) + 1))
    gone = times * speed_deg_s
    angles = np.column_stack(
        [np.interp(gone, reached[new], motion.angles_deg[: top + 1, n][new]) for n in range(motion.angles_deg.shape[1])]
    )
    angles[:, axis] = motion.angles_deg[0, axis] + outward * gone
    return Motion(times, angles), axis + 1


def curves(path_s: ArrayLike, angle_deg: ArrayLike, torque_nm: ArrayLike, outward: float) -> list[TorqueAngleCurve]:
    """Return the curve of each complete repetition from samples ``(n,)``: place on the path, motor angle and torque."""
    path = np.asarray(path_s, dtype=np.float64)
    angle, torque = (outward * np.asarray(values, dtype=np.float64) for values in (angle_deg, torque_nm))
    moving = np.flatnonzero(np.diff(path) != 0.0)
    forward = np.diff(path)[moving] > 0.0
    parts = np.split(moving, np.flatnonzero(np.diff(forward)) + 1)
    strokes = [(part, path[part[-1]] > path[part[0]]) for part in parts if np.ptp(path[part]) >= _SHORTEST_S]
    complete_curves = []
    for (out, is_out), (back, back_is_out) in pairwise(strokes):
        if is_out and not back_is_out:
            curve = _curve((angle[out], torque[out]), (angle[back], torque[back]), float(angle[out[0]]) + START_DEG)
            if np.any(curve.returned):
                complete_curves.append(curve)
    return complete_curves


def _curve(out: tuple[Floats, Floats], back: tuple[Floats, Floats], from_deg: float) -> TorqueAngleCurve:
    """Return the curve of the angles and torques of a way out and a way back. The way back is NaN near the turn."""
    first, last = (math.floor(float(angle) / PLACE_DEG) for angle in (min(out[0].min(), back[0].min()), out[0].max()))
    places = PLACE_DEG * np.arange(first, last + 1, dtype=np.float64)
    at_out, at_back = (_at_places(places, *way) for way in (out, back))
    at_back[places > min(out[0].max(), back[0].max()) - TURN_DEG] = np.nan
    known = ~np.isnan(at_out) & (places >= from_deg)
    return TorqueAngleCurve(places[known], at_out[known], at_back[known])


def _at_places(places_deg: Floats, angle_deg: Floats, torque_nm: Floats) -> Floats:
    """Return the torque at the places, NaN before the first and after the last place with enough samples."""
    place = np.rint((angle_deg - places_deg[0]) / PLACE_DEG).astype(int)
    count, angles, torques = (
        np.bincount(place, values, len(places_deg) + 1) for values in (None, angle_deg, torque_nm)
    )
    has_samples = count >= _LEAST_SAMPLES
    if not np.any(has_samples):
        return np.full(len(places_deg), np.nan)
    # An encoder's counts are unevenly spread over the places: a mean torque belongs to the mean angle.
    means_deg = angles[has_samples] / count[has_samples]
    values = np.interp(places_deg, means_deg, torques[has_samples] / count[has_samples])
    inside = (places_deg >= means_deg[0] - PLACE_DEG / 4) & (places_deg <= means_deg[-1] + PLACE_DEG / 4)
    torque_nm_at: Floats = np.where(inside, values, np.nan)
    return torque_nm_at


def together(repetitions: Sequence[TorqueAngleCurve]) -> TorqueAngleCurve:
    """Return the mean of the repetitions at the places that all have.

    :raises TooFewWaysError: without any.
    """
    if not repetitions:
        raise TooFewWaysError("no complete repetition")
    common = [_at_common(repetition, repetitions) for repetition in repetitions]
    return TorqueAngleCurve(
        common[0].places_deg,
        np.mean([curve.out_nm for curve in common], axis=0),
        np.mean([curve.back_nm for curve in common], axis=0),
    ).completed()


def baseline_curve(repetitions: Sequence[TorqueAngleCurve]) -> TorqueAngleCurve:
    """Return the baseline of ways out and back with the test weight.

    :raises TooFewWaysError: without any.
    """
    curve = together(repetitions)
    mean_nm, opposing_nm = (_smooth(values, _BASELINE_PLACES) for values in (curve.mean_nm, curve.opposing_nm))
    return TorqueAngleCurve(curve.places_deg, mean_nm + opposing_nm, mean_nm - opposing_nm)


def _at_common(curve: TorqueAngleCurve, other_curves: Sequence[TorqueAngleCurve]) -> TorqueAngleCurve:
    places = curve.places_deg
    keep = np.all([np.isin(places, other.places_deg) for other in other_curves], axis=0)
    return TorqueAngleCurve(places[keep], curve.out_nm[keep], curve.back_nm[keep])


def arm_growth(angles_deg: ArrayLike, motor: int, side: Side, outward: float) -> Floats:
    """Return how a motor's torque grows with both moments of the arm, for postures ``(n, 5)``: ``(n, 2)``."""
    angles = np.asarray(angles_deg, dtype=np.float64)
    at_rest = PathPoint(angles, np.zeros_like(angles), np.zeros_like(angles))
    # Slopes of the heights of a point forward and of one along the arm.
    growth: Floats = outward * arm_motion(at_rest, side).slopes[..., motor - 1, 2, [0, 2]]
    return growth


def measured(
    repetitions: Sequence[TorqueAngleCurve],
    baseline: TorqueAngleCurve,
    growth: Floats,
    weighed_deg: tuple[float, float],
    chosen_nm: float,
) -> EndFeelResult:
    """Return the end-feel.

    :param baseline: with the test weight, at least as far as the repetitions.
    :param growth: ``(n, 2)``, :func:`arm_growth` at the baseline's places.
    :param weighed_deg: outward angles between which the shoulder is free.
    :raises TooFewWaysError: without two repetitions.
    :raises GuardingError: when they do not agree.
    """
    if len(repetitions) < 2:
        raise TooFewWaysError("two repetitions or more are needed")
    common = [_at_common(repetition, [*repetitions, baseline]) for repetition in repetitions]
    base = _at_common(baseline, common)
    grows = growth[np.isin(baseline.places_deg, base.places_deg)]
    places = base.places_deg
    free = (
        (places >= weighed_deg[0]) & (places <= weighed_deg[1]) & np.all([curve.returned for curve in common], axis=0)
    )
    residual_nm = np.mean([curve.mean_nm - base.mean_nm for curve in common], axis=0)
    factors = _arm_factors(grows[free], residual_nm[free])
    disagreement_nm = _disagreement_nm(common)
    if disagreement_nm > DISAGREEMENT_NM:
        raise GuardingError(disagreement_nm)
    stated_nm, onset_nm = STATED_SHARE * chosen_nm, ONSET_SHARE * chosen_nm
    weight_nm = growth @ factors
    net = [_without_weight(repetition, baseline, weight_nm) for repetition in repetitions]
    values = [figures_of(curve, stated_nm, onset_nm) for curve in net]
    reason = next((value for value in values if isinstance(value, str)), None)
    if reason == "torque_not_reached" and places[-1] <= weighed_deg[1] + TURN_DEG:
        # The device takes an arm back where its weighing ends, when the weight found there is uncertain.
        reason = "arm_not_weighed"
    figures = [_behind_cuff(value) for value in values if not isinstance(value, str)]
    return EndFeelResult(
        stated_nm,
        onset_nm,
        None if reason else Figures(*np.mean(figures, axis=0).tolist()),
        None
        if reason
        else Figures(*(_T_95[len(figures)] * np.std(figures, axis=0, ddof=1) / np.sqrt(len(figures))).tolist()),
        reason,
        together(net),
        disagreement_nm,
    )


def _without_weight(repetition: TorqueAngleCurve, baseline: TorqueAngleCurve, weight_nm: Floats) -> TorqueAngleCurve:
    """Return a repetition less the baseline and the arm's weight, which is ``(n,)`` at the baseline's places."""
    curve = _at_common(repetition, [baseline])
    base = _at_common(baseline, [curve])
    weight_nm = weight_nm[np.isin(baseline.places_deg, base.places_deg)]
    return TorqueAngleCurve(
        base.places_deg, curve.out_nm - base.out_nm - weight_nm, curve.back_nm - base.back_nm - weight_nm
    ).completed()


def _arm_factors(growth: Floats, torque_nm: Floats) -> Floats:
    products = growth.T @ growth + _MOMENT_PRIOR_NM**2 * np.eye(growth.shape[1])
    return np.asarray(np.linalg.solve(products, growth.T @ torque_nm), dtype=np.float64)


def _disagreement_nm(common: Sequence[TorqueAngleCurve]) -> float:
    """Return the largest RMS difference of the repetitions from their mean, over some neighbouring places of a way."""
    worst = 0.0
    returned = np.all([curve.returned for curve in common], axis=0)
    for ways in (np.array([curve.out_nm for curve in common]), np.array([curve.back_nm[returned] for curve in common])):
        square = np.sum((ways - ways.mean(axis=0)) ** 2, axis=0) / (len(ways) - 1)
        span = min(_SPAN_PLACES, len(square))
        if span:
            worst = max(worst, float(np.sqrt(np.convolve(square, np.full(span, 1 / span), "valid").max())))
    return worst


def figures_of(curve: TorqueAngleCurve, stated_nm: float, onset_nm: float) -> Figures | Unmeasured:
    """Return the figures of a curve without weight, or why there are none."""
    places_deg, elastic_nm = curve.places_deg, _smooth(curve.mean_nm)
    if len(elastic_nm) == 0 or elastic_nm[-1] < stated_nm:
        return "torque_not_reached"
    range_deg, onset_deg = (_last_crossing(places_deg, elastic_nm, level) for level in (stated_nm, onset_nm))
    if range_deg is None or onset_deg is None:
        return "resistance_from_start"
    inside = curve.between(onset_deg, range_deg).opposing_nm
    return Figures(
        range_deg,
        onset_deg,
        _slope(places_deg, elastic_nm, onset_deg, range_deg),
        _slope(places_deg, elastic_nm, onset_deg + 2 / 3 * (range_deg - onset_deg), range_deg),
        2 * float(np.mean(inside if len(inside) else curve.opposing_nm[-1:])),
    )


def _behind_cuff(figures: Figures) -> Figures:
    """Return the figures with the stiffness of the shoulder alone. Shoulder and cuff are springs in series."""

    def alone(both_nm_deg: float) -> float:
        return both_nm_deg / (1.0 - min(both_nm_deg / _CUFF_NM_DEG, _STIFFEST_SHARE))

    return figures._replace(
        stiffness_nm_deg=alone(figures.stiffness_nm_deg), last_third_nm_deg=alone(figures.last_third_nm_deg)
    )


def _smooth(torque_nm: Floats, places: int = _SMOOTH_PLACES) -> Floats:
    """Return the values of parabolas through an odd number of neighbouring places (Savitzky and Golay 1964, Anal Chem 36, 1627-1639)."""
    if len(torque_nm) < places:
        return torque_nm
    half = places // 2
    parabolas = np.vander(np.arange(places) - float(half), 3)
    fit = parabolas @ np.linalg.pinv(parabolas)
    inner = sliding_window_view(torque_nm, places) @ fit[half]
    smooth: Floats = np.concatenate([fit[:half] @ torque_nm[:places], inner, fit[-half:] @ torque_nm[-places:]])
    return smooth


def _last_crossing(places_deg: Floats, torque_nm: Floats, level_nm: float) -> float | None:
    below = np.flatnonzero(torque_nm < level_nm)
    if len(below) == 0:
        return None
    n = below[-1]
    return float(np.interp(level_nm, torque_nm[n : n + 2], places_deg[n : n + 2]))


def _slope(places_deg: Floats, torque_nm: Floats, low_deg: float, high_deg: float) -> float:
    at = np.linspace(low_deg, high_deg, _POINTS)
    return float(np.polyfit(at, np.interp(at, places_deg, torque_nm), 1)[0])
