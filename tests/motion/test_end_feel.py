"""Figures of the end-feel from curves whose truth is known."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from kata.motion import end_feel
from kata.motion.edit import Motion
from kata.motion.end_feel import (
    DISAGREEMENT_NM,
    PLACE_DEG,
    TURN_DEG,
    Figures,
    GuardingError,
    TooFewWaysError,
    TorqueAngleCurve,
    arm_growth,
    baseline_curve,
    curves,
    figures_of,
    measured,
    together,
    way_out,
)
from kata.motion.linkage import Floats
from tests.support.stepped import REST_DEG

CHOSEN_NM = 2.0
PLACES = np.arange(5.0, 95.0, PLACE_DEG)
FRICTION_NM = 0.5
FREE_DEG = (8.0, 50.0)
CUFF_NM_DEG = 3.1


def elastic_nm(angles_deg: Floats, peak_deg: float = 98.0) -> Floats:
    """Return the torque of a capsule that gives 3 Nm at the peak and e times less 6 deg before."""
    return 3.0 * np.exp((angles_deg - peak_deg) / 6.0)


def weight_nm(angles_deg: Floats) -> Floats:
    return 2.0 * np.sin(np.radians(angles_deg)) - 0.4 * np.sin(np.radians(2 * angles_deg))


def growth() -> Floats:
    postures = np.tile(np.array(REST_DEG), (len(PLACES), 1))
    postures[:, 2] = PLACES
    return arm_growth(postures, 3, "right", 1.0)


BASELINE = TorqueAngleCurve(PLACES, weight_nm(PLACES) + FRICTION_NM, weight_nm(PLACES) - FRICTION_NM)


def repetition(
    tone_nm: float = 0.1, heavier: float = 0.6, shift_deg: float = 0.0, wide_nm: float = 0.0
) -> TorqueAngleCurve:
    """Return a repetition of an arm of another weight whose muscles and capsule oppose the movement."""
    mean = weight_nm(PLACES) + growth() @ np.array([0.0, heavier]) + elastic_nm(PLACES - shift_deg)
    half = FRICTION_NM + tone_nm + wide_nm * elastic_nm(PLACES)
    return TorqueAngleCurve(PLACES, mean + half, mean - half)


def test_weight_friction_and_tone_are_taken_from_the_torque() -> None:
    found = measured([repetition(0.05), repetition(0.1), repetition(0.15)], BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert (found.stated_nm, found.onset_nm) == (1.2, 0.5)
    assert found.figures is not None and found.interval is not None
    assert found.figures.range_deg == pytest.approx(98.0 + 6.0 * np.log(1.2 / 3.0), abs=0.2)
    assert found.figures.onset_deg == pytest.approx(98.0 + 6.0 * np.log(0.5 / 3.0), abs=0.3)
    mean_slope = (1.2 - 0.5) / (6.0 * np.log(1.2 / 0.5))
    assert found.figures.stiffness_nm_deg == pytest.approx(mean_slope / (1.0 - mean_slope / CUFF_NM_DEG), rel=0.05)
    assert found.figures.last_third_nm_deg > found.figures.stiffness_nm_deg
    assert found.figures.hysteresis_nm == pytest.approx(0.2, abs=0.02)
    assert found.curve.mean_nm[-1] == pytest.approx(elastic_nm(PLACES)[-1], abs=0.05)


@pytest.mark.parametrize(("both", "shoulder"), [(0.0, 0.0), (0.31, 0.31 / 0.9), (1.55, 3.1), (3.5, 17.5)])
def test_cuff_is_a_spring_in_front_of_the_shoulder(both: float, shoulder: float) -> None:
    """A shoulder much stiffer than the cuff cannot be told from a rigid one."""
    found = end_feel._behind_cuff(Figures(90.0, 85.0, both, both, 0.1))
    assert found == pytest.approx((90.0, 85.0, shoulder, shoulder, 0.1))


def test_interval_holds_the_spread_of_three_repetitions() -> None:
    three = [repetition(shift_deg=shift) for shift in (-0.3, 0.0, 0.3)]
    found = measured(three, BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert found.interval is not None
    assert found.interval.range_deg == pytest.approx(4.303 * 0.3 / np.sqrt(3.0), rel=0.02)


@pytest.mark.parametrize("against_nm", [-0.8, 0.8])
def test_patient_who_works_during_one_repetition_is_refused(against_nm: float) -> None:
    worked = repetition()
    burst = np.where((PLACES > 30.0) & (PLACES < 40.0), against_nm, 0.0)
    worked = TorqueAngleCurve(PLACES, worked.out_nm + burst, worked.back_nm)
    with pytest.raises(GuardingError, match=r"the repetitions differ by 0\.4") as refused:
        measured([repetition(), worked, repetition()], BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert refused.value.disagreement_nm > DISAGREEMENT_NM


def test_shoulder_that_does_not_reach_the_torque_has_no_figures() -> None:
    soft = [
        TorqueAngleCurve(curve.places_deg, curve.out_nm, curve.back_nm) for curve in [repetition(shift_deg=15.0)] * 3
    ]
    found = measured(soft, BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert (found.unmeasured, found.figures, found.interval) == ("torque_not_reached", None, None)
    assert found.curve.places_deg[-1] == 94.5


def test_arm_taken_back_where_its_weighing_ends_was_not_weighed() -> None:
    back_early = [repetition().between(0.0, FREE_DEG[1] + beyond_deg) for beyond_deg in (0.0, 0.5, 1.0)]
    found = measured(back_early, BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert (found.unmeasured, found.figures) == ("arm_not_weighed", None)
    later = [repetition().between(0.0, FREE_DEG[1] + 5.0)] * 3
    assert measured(later, BASELINE, growth(), FREE_DEG, CHOSEN_NM).unmeasured == "torque_not_reached"


def test_noise_of_a_baseline_is_smoothed_and_its_weight_kept() -> None:
    noise_nm = np.random.default_rng(1).normal(0.0, 0.1, (2, len(PLACES)))
    noisy = TorqueAngleCurve(
        PLACES, weight_nm(PLACES) + FRICTION_NM + noise_nm[0], weight_nm(PLACES) - FRICTION_NM + noise_nm[1]
    )
    found = baseline_curve([noisy])
    assert np.std(found.mean_nm - weight_nm(PLACES)) < 0.4 * np.std(noisy.mean_nm - weight_nm(PLACES))
    assert np.abs(np.mean(found.mean_nm - weight_nm(PLACES))) < 0.02
    assert found.opposing_nm == pytest.approx(FRICTION_NM, abs=0.06)


def test_resistance_from_the_first_place_on_has_no_onset() -> None:
    stiff = TorqueAngleCurve(PLACES, np.full(len(PLACES), 1.5), np.full(len(PLACES), 1.5))
    assert figures_of(stiff, 1.2, 0.5) == "resistance_from_start"


def test_one_repetition_is_too_few() -> None:
    with pytest.raises(TooFewWaysError):
        measured([repetition()], BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    with pytest.raises(TooFewWaysError):
        together([])


def test_repetitions_are_compared_where_all_have_been() -> None:
    short = repetition().between(0.0, 90.0)
    found = measured([repetition(), short, repetition()], BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert found.curve.places_deg[-1] == 90.0


def test_repetition_counts_beyond_the_turn_of_another() -> None:
    early = repetition(shift_deg=-0.8)
    three = [early.between(0.0, 92.0), repetition(), repetition()]
    found = measured(three, BASELINE, growth(), FREE_DEG, CHOSEN_NM)
    assert found.figures is not None
    assert found.figures.range_deg == pytest.approx(98.0 + 6.0 * np.log(1.2 / 3.0) - 0.8 / 3, abs=0.2)


def samples(outward: float, turns_deg: tuple[float, ...]) -> tuple[Floats, Floats, Floats]:
    """Return path, angle and torque of ways at 5 deg/s from 10 deg with friction and a capsule."""
    pieces = []
    for turn_deg in turns_deg:
        way = np.arange(10.0, turn_deg, 0.05)
        pieces += [way, way[::-1]]
    angle = np.concatenate(pieces)
    forward = np.concatenate([np.sign(np.diff(angle)), [-1.0]])
    counts = np.round(angle / 0.088) * 0.088
    return (angle - 10.0) / 5.0, outward * counts, outward * (elastic_nm(angle) + FRICTION_NM * forward)


@pytest.mark.parametrize("outward", [1.0, -1.0])
def test_samples_become_one_curve_for_each_repetition(outward: float) -> None:
    found = curves(*samples(outward, (96.0, 95.0, 94.0)), outward)
    assert [curve.places_deg[-1] for curve in found] == [95.5, 94.5, 93.5]
    assert [curve.places_deg[curve.returned][-1] for curve in found] == [94.0, 93.0, 92.0]
    for curve in found:
        assert curve.places_deg[0] == 13.5
        whole = curve.completed()
        assert whole.opposing_nm == pytest.approx(np.full(len(curve.places_deg), FRICTION_NM), abs=0.02)
        assert whole.mean_nm == pytest.approx(elastic_nm(curve.places_deg), abs=0.03)


def test_stiff_capsule_is_measured_up_to_the_turn() -> None:
    """0.4 Nm in 1 deg: what is left out of the way back must not hide the stated torque."""
    base = TorqueAngleCurve(PLACES, np.full(len(PLACES), FRICTION_NM), np.full(len(PLACES), -FRICTION_NM))
    elastic = np.maximum(0.4 * (PLACES - 90.0), 0.0)
    back = np.where(PLACES[-1] - TURN_DEG < PLACES, np.nan, elastic - FRICTION_NM - 0.1)
    curve = TorqueAngleCurve(PLACES, elastic + FRICTION_NM + 0.1, back)
    found = measured([curve] * 3, base, growth(), FREE_DEG, CHOSEN_NM)
    assert found.figures is not None
    assert found.figures.range_deg == pytest.approx(93.0, abs=0.2)


def test_repetition_that_turns_at_once_is_left_out() -> None:
    path, angle, torque = samples(1.0, (15.0, 95.0, 95.0))
    assert len(curves(path, angle, torque, 1.0)) == 2


def test_a_way_without_its_return_is_left_out() -> None:
    path, angle, torque = samples(1.0, (96.0, 95.0))
    cut = len(path) - round(85.0 / 0.05) - 10
    assert len(curves(path[:cut], angle[:cut], torque[:cut], 1.0)) == 1


def recorded() -> Motion:
    """Return a motion up and back by hand, with tremor, in which motor 1 follows motor 3."""
    times = np.linspace(0.0, 8.0, 801)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 2] = 10.0 + 40.0 * (1 - np.cos(2 * np.pi * times / 8.0)) + 0.1 * np.sin(40.0 * times)
    angles[:, 0] = REST_DEG[0] + 0.1 * (angles[:, 2] - 10.0)
    return Motion(times, angles)


def test_way_out_has_constant_speed_and_ends_further() -> None:
    way, motor = way_out(recorded(), 5.0, further_deg=12.0)
    assert motor == 3
    assert np.diff(way.angles_deg[:, 2]) / np.diff(way.times_s) == pytest.approx(np.full(len(way.times_s) - 1, 5.0))
    assert way.angles_deg[-1, 2] == pytest.approx(102.0, abs=0.3)
    assert way.angles_deg[-1, 0] == pytest.approx(REST_DEG[0] + 8.0, abs=0.1)


@pytest.mark.parametrize("count", [13, 14, 200])
def test_smoothing_is_the_filter_of_savitzky_and_golay(count: int) -> None:
    torque_nm = np.random.default_rng(count).normal(0.0, 4.0, count)
    assert end_feel._smooth(torque_nm) == pytest.approx(savgol_filter(torque_nm, 13, 2), abs=1e-12)
