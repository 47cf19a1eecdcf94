"""The patient's angle from goniometer readings: its uncertainty covers simulated patients, and grows where little is known."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.motion.patient_angle import (
    OFFSET_DEG,
    READING_DEG,
    SHAPE_DEG,
    SLIP_DEG_PER_ROOT_MIN,
    SLOPE,
    PatientAngleEstimator,
    PoseReading,
)
from tests.support.examples import examples

_PATIENTS = 4_000
_STEP_MIN = 0.5
_SESSION_MIN = 40.0


@dataclass(frozen=True)
class _Simulated:
    """How the simulated arms lie in the cuff; the stated rates by default."""

    slip: float = SLIP_DEG_PER_ROOT_MIN
    offset_deg: float = OFFSET_DEG
    slope: float = SLOPE
    reading_deg: float = READING_DEG


def covered(simulated: _Simulated, seed: int) -> float:
    """Return the share of simulated patients whose angle is within the uncertainty, at a random pose and time of a session."""
    random = np.random.default_rng(seed)
    inside = 0
    for _ in range(_PATIENTS):
        offset, slope = random.normal(0.0, simulated.offset_deg), random.normal(0.0, simulated.slope)
        steps = random.normal(0.0, simulated.slip * np.sqrt(_STEP_MIN), round(_SESSION_MIN / _STEP_MIN))
        slip = np.concatenate([[0.0], np.cumsum(steps)])

        def patient_deg(apparatus_deg: float, at: int, *, offset: float = offset, slope: float = slope) -> float:
            shape = random.normal(0.0, SHAPE_DEG)
            return float(apparatus_deg * (1 + slope) + offset + slip[at] + shape)  # noqa: B023 - called in this turn

        low, high = random.uniform(0.0, 40.0), random.uniform(60.0, 120.0)
        readings = []
        for apparatus_deg in (low, high):
            at = int(random.integers(0, len(slip)))
            read = patient_deg(apparatus_deg, at) + random.normal(0.0, simulated.reading_deg)
            readings.append(PoseReading(apparatus_deg, read, at * _STEP_MIN))
        place, at = random.uniform(-10.0, 130.0), int(random.integers(0, len(slip)))
        found = PatientAngleEstimator(readings).at(place, at * _STEP_MIN)
        inside += abs(found.angle_deg - patient_deg(place, at)) <= found.uncertainty_deg
    return inside / _PATIENTS


@pytest.mark.parametrize("slip", [0.0, SLIP_DEG_PER_ROOT_MIN / 2, SLIP_DEG_PER_ROOT_MIN])
def test_uncertainty_covers_patients_with_slip_up_to_the_stated_rate(slip: float) -> None:
    # Three standard deviations of a share of 0.95 in 4,000 patients are 0.010.
    assert covered(_Simulated(slip=slip), seed=1) >= 0.94


def test_slip_at_the_stated_rate_is_covered_as_stated() -> None:
    assert covered(_Simulated(), seed=2) == pytest.approx(0.95, abs=0.01)


def test_four_times_the_stated_slip_is_not_covered() -> None:
    assert covered(_Simulated(slip=4 * SLIP_DEG_PER_ROOT_MIN), seed=3) < 0.85


def test_patients_with_half_the_differences_are_covered() -> None:
    gentle = _Simulated(offset_deg=OFFSET_DEG / 2, slope=SLOPE / 2, reading_deg=READING_DEG / 2)
    assert covered(gentle, seed=4) >= 0.95


ANGLES = st.floats(-60.0, 150.0)
SPREADS = st.floats(10.0, 100.0)
MINUTES = st.floats(0.0, 90.0)


@examples(few=30, many=300)
@given(low=ANGLES, spread=SPREADS, difference=st.floats(-20.0, 20.0))
def test_estimate_agrees_with_readings_that_agree(low: float, spread: float, difference: float) -> None:
    readings = [PoseReading(x, x + difference, 0.0) for x in (low, low + spread)]
    for reading in readings:
        found = PatientAngleEstimator(readings).at(reading.apparatus_deg, 0.0)
        assert abs(found.angle_deg - reading.patient_deg) <= found.uncertainty_deg


@examples(few=30, many=300)
@given(low=ANGLES, spread=SPREADS, place=ANGLES, at=MINUTES, later=st.floats(0.0, 60.0))
def test_uncertainty_grows_with_the_time_since_the_readings(
    low: float, spread: float, place: float, at: float, later: float
) -> None:
    estimator = PatientAngleEstimator([PoseReading(x, x + 8.0, at) for x in (low, low + spread)])
    assert estimator.at(place, at + later).uncertainty_deg >= estimator.at(place, at).uncertainty_deg - 1e-9


@examples(few=30, many=300)
@given(low=ANGLES, spread=SPREADS, place=ANGLES, more=ANGLES)
def test_another_reading_never_makes_the_estimate_less_certain(
    low: float, spread: float, place: float, more: float
) -> None:
    two = [PoseReading(x, x, 0.0) for x in (low, low + spread)]
    three = [*two, PoseReading(more, more, 0.0)]
    assert (
        PatientAngleEstimator(three).at(place, 5.0).uncertainty_deg
        <= PatientAngleEstimator(two).at(place, 5.0).uncertainty_deg + 1e-9
    )


@examples(few=30, many=300)
@given(low=ANGLES, spread=SPREADS, place=ANGLES, at=MINUTES)
def test_uncertainty_is_never_below_the_published_estimators(
    low: float, spread: float, place: float, at: float
) -> None:
    readings = [PoseReading(x, x, 0.0) for x in (low, low + spread)] * 20
    assert PatientAngleEstimator(readings).at(place, at).uncertainty_deg >= 1.96 * SHAPE_DEG


def test_ten_degrees_are_two_poses_although_numbers_are_rounded() -> None:
    low = 6.750603399534116
    assert (low + 10.0) - low < 10.0
    assert PatientAngleEstimator([PoseReading(x, x, 0.0) for x in (low, low + 10.0)]).at(low, 0.0).uncertainty_deg > 0.0


@pytest.mark.parametrize("places", [[], [30.0], [30.0, 39.9]])
def test_readings_at_one_pose_give_no_estimate(places: list[float]) -> None:
    with pytest.raises(ValueError, match="two poses"):
        PatientAngleEstimator([PoseReading(x, x, 0.0) for x in places])
