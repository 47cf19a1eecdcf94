"""End-range time counts exactly on made signals, and finds the torque at the shoulder under friction and weight."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.motion.arm_load import ArmLoad
from kata.motion.end_range import (
    GAP_S,
    EndRange,
    EndRangeCounter,
    EndRangeThreshold,
    end_of_motion,
    end_range_time_s,
)
from kata.motion.linkage import Floats
from kata.motion.method import LoadModel
from kata.motion.path import PathPoint
from kata.simulator.parameters import REST_DEG

FAR = EndRange(90.0, 1)
ARM = ArmLoad(inertia=(0.1, 0.1, 0.01, 0.0, 0.0, 0.0, 0.1, 0.0, -0.5, 3.0))


@settings(max_examples=60, deadline=None)
@given(
    held_s=st.floats(0.0, 30.0),
    before_s=st.floats(0.1, 5.0),
    step_s=st.floats(0.01, 0.1),
    outward=st.sampled_from((1, -1)),
)
def test_held_time_counts_within_one_sample(held_s: float, before_s: float, step_s: float, outward: int) -> None:
    times = np.arange(0.0, before_s + held_s + before_s, step_s)
    inside = (times >= before_s) & (times <= before_s + held_s)
    angle = outward * np.where(inside, 85.0, 20.0)
    found = end_range_time_s(times, angle, np.full(len(times), outward * 1.0), EndRange(outward * 90.0, outward))
    assert found == pytest.approx(held_s, abs=step_s + 1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), cut=st.integers(1, 198))
def test_parts_add_up_and_wider_bands_count_more(seed: int, cut: int) -> None:
    draw = np.random.default_rng(seed)
    times, angle, torque = np.cumsum(draw.uniform(0.001, 0.1, 200)), draw.uniform(70, 95, 200), draw.uniform(-1, 2, 200)
    whole = end_range_time_s(times, angle, torque, FAR)
    first = end_range_time_s(times[: cut + 1], angle[: cut + 1], torque[: cut + 1], FAR)
    assert first + end_range_time_s(times[cut:], angle[cut:], torque[cut:], FAR) == pytest.approx(whole)
    assert (
        whole
        <= end_range_time_s(times, angle, torque, EndRange(90.0, 1, EndRangeThreshold(band_deg=15.0)))
        <= times[-1] - times[0]
    )
    assert whole <= end_range_time_s(times, angle, torque, EndRange(90.0, 1, EndRangeThreshold(torque_nm=0.2)))


def test_a_gap_and_too_little_torque_do_not_count() -> None:
    times = np.array([0.0, 0.1, 0.2, 0.2 + 2 * GAP_S, 0.3 + 2 * GAP_S, 0.4 + 2 * GAP_S])
    torque = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.4])
    assert end_range_time_s(times, np.full(6, 95.0), torque, FAR) == pytest.approx(0.35)
    assert end_range_time_s(times, np.full(6, 95.0), -torque, FAR) == 0.0


def test_end_is_the_place_farthest_from_rest() -> None:
    taught = np.array([[0.0, 0.0, 10.0, 0.0, 20.0], [0.0, 0.0, 95.0, 15.0, -40.0], [0.0, 0.0, 10.0, 0.0, 30.0]])
    assert end_of_motion(taught, 3) == EndRange(95.0, 1)
    assert end_of_motion(taught, 5) == EndRange(-40.0, -1)
    assert end_of_motion(taught, 4) is None


def lifted(rate_hz: int) -> tuple[Floats, Floats, Floats]:
    """Return times, angles and speeds of two lifts to 90 deg that are held for 6 s each."""
    times = np.arange(0.0, 36.0, 1 / rate_hz)
    knots = [0.0, 1.0, 7.0, 13.0, 18.0, 19.0, 25.0, 31.0, 36.0]
    place = np.interp(times, knots, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0])
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 2] = 8.0 + 82.0 * place
    return times, angles, np.gradient(angles, times, axis=0)


@pytest.mark.parametrize("heavier", [0.0, 0.3])
@pytest.mark.parametrize("rate_hz", [10, 100])
def test_weight_and_friction_are_not_resistance(heavier: float, rate_hz: int) -> None:
    times, angles, speed = lifted(rate_hz)
    share = np.full(5, 0.9)
    real = LoadModel(
        np.full(5, 0.01), np.zeros(5), np.full(5, 0.3), share, ArmLoad(inertia=(*ARM.inertia[:8], -0.5 - heavier, 3.0))
    )
    known = LoadModel(real.damping_nm_s_deg, real.inertia_nm_s2_deg, real.coulomb_nm, share, ARM)
    torque = real.torque_nm(PathPoint(angles, speed, np.zeros_like(speed)))
    capsule_nm = 0.08 * np.maximum(angles[:, 2] - 77.0, 0.0)
    torque[:, 2] += share[2] * capsule_nm
    truth = end_range_time_s(times, angles[:, 2], capsule_nm, FAR)
    found = end_range_times_s(times, angles, torque, angles, known)
    assert truth > 12.0
    assert found == {3: pytest.approx(truth, rel=0.02)}
    relaxed = end_range_times_s(times, angles, torque - share * np.outer(capsule_nm, np.eye(5)[2]), angles, known)
    assert relaxed == {3: pytest.approx(0.0, abs=0.1)}


def lifted_with_capsule(heavier: float = 0.2) -> tuple[Floats, Floats, Floats, LoadModel]:
    """Return times, angles and torques of :func:`lifted` at 100 Hz with a capsule, and the identified load."""
    times, angles, speed = lifted(100)
    share = np.full(5, 0.9)
    known = LoadModel(np.full(5, 0.01), np.zeros(5), np.full(5, 0.3), share, ARM)
    real = replace(known, arm=ArmLoad(inertia=(*ARM.inertia[:8], -0.5 - heavier, 3.0)))
    torque = real.torque_nm(PathPoint(angles, speed, np.zeros_like(speed)))
    torque[:, 2] += share[2] * 0.08 * np.maximum(angles[:, 2] - 77.0, 0.0)
    return times, angles, torque, known


def end_range_times_s(
    times: Floats,
    angles: Floats,
    torques: Floats,
    taught: Floats,
    load: LoadModel,
    thresholds: Mapping[int, EndRangeThreshold] | None = None,
) -> dict[int, float]:
    """Return the end-range times of a whole run, counted in a single part."""
    counter = EndRangeCounter(taught, load, thresholds or {})
    counter.add(times, angles, torques)
    return counter.times_s()


@pytest.mark.parametrize("samples", [7, 10, 100])
def test_live_count_equals_the_count_after_the_run(samples: int) -> None:
    times, angles, torque, load = lifted_with_capsule()
    whole = end_range_times_s(times, angles, torque, angles, load)[3]
    counter = EndRangeCounter(angles, load)
    assert counter.times_s() == {3: 0.0}
    seen = []
    for first in range(0, len(times), 10 * samples):
        # Ten samples a second, as the service receives them.
        part = slice(first, first + 10 * samples, 10)
        counter.add(times[part], angles[part], torque[part])
        seen.append(counter.times_s()[3])
    assert whole > 12.0
    assert seen[-1] == pytest.approx(whole, rel=0.02)
    assert np.all(np.diff(seen) >= -0.1)


def test_prescribed_band_and_torque_of_one_motor_count() -> None:
    times, angles, torque, load = lifted_with_capsule()
    usual = end_range_times_s(times, angles, torque, angles, load)[3]
    narrow = end_range_times_s(times, angles, torque, angles, load, {3: EndRangeThreshold(2.0, 0.5)})[3]
    strong = end_range_times_s(times, angles, torque, angles, load, {3: EndRangeThreshold(10.0, 4.0)})[3]
    other = end_range_times_s(times, angles, torque, angles, load, {4: EndRangeThreshold(10.0, 4.0)})[3]
    assert 12.0 < narrow < usual == other
    assert strong == 0.0


def test_unknown_load_gives_no_time() -> None:
    times, angles, _ = lifted(10)
    assert end_range_times_s(times, angles, np.full(angles.shape, 2.0), angles, LoadModel()) == {}
