"""Drive and load of a station are identified from a measured movement."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from kata.motion.arm_load import ArmLoad
from kata.motion.identify_load import identify_load
from kata.motion.linkage import Floats
from kata.motion.method import LoadModel, after_integral
from kata.motion.path import PathPoint

ARM = ArmLoad(
    inertia=(0.08, 0.0, 0.24, 0.0, -0.09, 0.0, 0.22, 0.0, -0.8, 3.0),
    link_nm=-0.4,
    girdle_nm_rad=(5.0, 4.0),
    balancer_n=17.0,
    balancer_m=(0.07, -0.28, 1.1),
)


def movement(seconds: float) -> Floats:
    """Return a measured movement of all axes, ``(n, 5)``."""
    times = np.arange(0, seconds, 0.01)
    waves = [
        np.sin(math.tau * (0.2 + 0.03 * n) * times + n) + 0.25 * np.sin(math.tau * (0.9 + 0.05 * n) * times)
        for n in range(5)
    ]
    return np.column_stack(waves) * [15.0, 10.0, 30.0, 40.0, 20.0] + [15.0, 109.0, 55.0, 50.0, -20.0]


def test_known_drive_and_load_are_identified() -> None:
    """The movement follows the model exactly; the noise is that of an encoder's steps."""
    measured = movement(30.0)
    speed = np.gradient(measured, 0.01, axis=0)
    acceleration = np.gradient(speed, 0.01, axis=0)
    share = np.array([1.0, 1.0, 1.06, 0.97, 1.0])
    model = LoadModel(np.full(5, 0.005), np.full(5, 0.002), np.full(5, 0.3), share, ARM)
    torque = model.torque_nm(PathPoint(measured, speed, acceleration))
    taken = np.full(5, 1 - math.exp(-0.01 / 0.5))
    lag = after_integral(0.07 * speed + 0.001 * acceleration + 2.0 * torque, taken)
    random = np.random.default_rng(1)
    noise = random.uniform(-0.044, 0.044, measured.shape)
    times = np.arange(len(measured)) * 0.01
    found = identify_load(times, measured + lag, measured + noise, torque)
    for axis in found.axes:
        assert axis.lag_s == pytest.approx(0.08, abs=0.003)
        assert axis.lag2_s2 == pytest.approx(0.005, abs=0.001)
        # The filter smooths the reversals of friction.
        assert axis.friction_deg == pytest.approx(0.6, abs=0.1)
        assert axis.droop_deg_nm == pytest.approx(2.0, rel=0.02)
        assert axis.integral_s == pytest.approx(0.5, rel=0.05)
        assert axis.damping_nm_s_deg == pytest.approx(0.005, abs=0.001)
        assert axis.coulomb_nm == pytest.approx(0.3, abs=0.05)
        assert axis.residual_deg < 0.1
        assert axis.residual_nm < 0.1
    assert found.axes[2].torque_share / found.axes[3].torque_share == pytest.approx(1.06 / 0.97, abs=0.03)
    # What other postures and movements need is known, too.
    rest = np.array([15.0, 109.0, 0.0, 0.0, 0.0])
    there = rest + random.uniform((-15.0, -10.0, 10.0, 0.0, -60.0), (15.0, 10.0, 100.0, 100.0, 20.0), (50, 5))
    other = PathPoint(there, random.normal(0.0, 20.0, (50, 5)), random.normal(0.0, 60.0, (50, 5)))
    parts = ("damping_nm_s_deg", "inertia_nm_s2_deg", "coulomb_nm", "torque_share")
    damping, inertia, coulomb, reported = np.array([[getattr(axis, part) for axis in found.axes] for part in parts])
    identified = LoadModel(damping, inertia, coulomb, reported, found.arm)
    error = identified.torque_nm(other) - model.torque_nm(other)
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 0.25)


def test_integral_that_leaves_the_lag_is_not_identified() -> None:
    times = np.arange(0, 30, 0.01)
    wave = 20 * np.sin(math.tau * 0.2 * times) + 5 * np.sin(math.tau * 0.9 * times)
    measured = np.column_stack([np.roll(wave, 500 * axis) for axis in range(5)])
    measured += np.array([15.0, 109.0, 55.0, 50.0, -20.0])
    speed = np.gradient(measured, 0.01, axis=0)
    acceleration = np.gradient(speed, 0.01, axis=0)
    lag = 0.08 * speed + 0.004 * acceleration + 0.3 * np.tanh(speed / 5.0) + 1.5
    noise = np.random.default_rng(1).uniform(-0.044, 0.044, measured.shape)
    torque = 0.01 * speed + np.random.default_rng(2).normal(0.0, 0.3, measured.shape)
    for found in identify_load(times, measured + lag, measured + noise, torque).axes:
        assert found.lag_s == pytest.approx(0.08, abs=0.001)
        assert found.lag2_s2 == pytest.approx(0.004, abs=0.0003)
        assert found.friction_deg == pytest.approx(0.3, abs=0.03)
        assert (found.integral_s, found.droop_deg_nm) == (0.0, 0.0)
        assert found.residual_deg < 0.06


def test_samples_without_information_are_refused() -> None:
    times = np.arange(0, 5, 0.01)
    wave = movement(5.0)
    with pytest.raises(ValueError, match="evenly spaced"):
        identify_load(np.where(times > 2, times + 1, times), wave, wave, wave)
    with pytest.raises(ValueError, match="motor 1 did not move"):
        identify_load(times, wave, np.zeros_like(wave), wave)
    with pytest.raises(ValueError, match="hundred"):
        identify_load(times[:50], wave[:50], wave[:50], wave[:50])
    with pytest.raises(ValueError, match="as many setpoints"):
        identify_load(times, wave, wave[:-1], wave)


def test_the_interval_of_a_lag_contains_the_true_lag() -> None:
    """Errors of neighbouring samples are alike, as those of real drives are."""
    measured = movement(24.0)
    speed = np.gradient(measured, 0.01, axis=0)
    times = np.arange(len(measured)) * 0.01
    inside, widths = 0, []
    for seed in range(4):
        random = np.random.default_rng(seed)
        errors = lfilter([1.0], [1.0, -0.98], random.normal(0.0, 0.1, measured.shape), axis=0)
        found = identify_load(times, measured + 0.08 * speed + errors, measured, np.zeros_like(measured))
        inside += sum(abs(axis.lag_s - 0.08) <= axis.lag_uncertainty_s for axis in found.axes)
        widths += [axis.lag_uncertainty_s for axis in found.axes]
    assert inside >= 17, "of 20; 95 % are expected"
    assert max(widths) < 0.02 and min(widths) > 0.0002, "neither certain nor without information"
