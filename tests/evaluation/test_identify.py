"""The lag of drives is identified from a measured movement."""

import math

import numpy as np
import pytest
from msgspec import structs

from kata.device.config import simulated
from kata.device.journal import PHASE_PLAYING
from kata.device.messages import Load
from kata.evaluation.identify import FRICTION_REVERSAL_DEG_S, identify
from kata.evaluation.station import VirtualStation
from kata.motion.approach import MinimumJerkMove
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.trajectory import Trajectory
from kata.simulator.parameters import DRIVES, GOAL_SMOOTHING_S, JOINTS, REST_DEG

STEP_S = 0.01
MIDDLE_DEG = (15.0, 109.0, 60.0, 60.0, -25.0)
REACH_DEG = (18.0, 12.0, 40.0, 60.0, 35.0)
WAVES_HZ = (0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 1.8)
FASTEST_DEG_S = 50.0
APPROACH_DEG_S = 20.0


def exercise(seconds: float, *motions: int) -> Floats:
    """Return movements at all speeds of a guided arm, and then some built-in motions: (n, 5) in degrees at 100 Hz.

    Friction cannot be separated from lag without slow movements, nor inertia without fast ones.
    """
    rows = [oscillation(seconds)]
    for number in motions:
        angles = motor_angles_deg(built_in_motions()[number - 1].poses_deg)
        approach = MinimumJerkMove(rows[-1][-1], angles[0], APPROACH_DEG_S)
        rows += [np.array([approach.at(time) for time in np.arange(0.0, approach.duration_s, STEP_S)]), angles]
    return np.concatenate(rows)


def oscillation(seconds: float) -> Floats:
    """Return a movement of all axes that begins and ends at rest."""
    times = np.arange(0.0, seconds, STEP_S)
    rise = np.minimum(1.0, np.minimum(times, times[-1] - times) / 4.0)
    rise = 3 * rise**2 - 2 * rise**3
    columns = []
    for n, (rest, middle, reach) in enumerate(zip(REST_DEG, MIDDLE_DEG, REACH_DEG, strict=True), start=1):
        waves = sum(np.sin(math.tau * hz * times + n * k**2) / hz for k, hz in enumerate(WAVES_HZ, start=1))
        fastest = np.abs(np.gradient(waves, times)).max()
        waves = waves * min(reach / np.abs(waves).max(), FASTEST_DEG_S / fastest)
        columns.append(rest + rise * (middle - rest + waves))
    return np.column_stack(columns)


def played(setpoint_deg: Floats, seed: int | None) -> tuple[Floats, Floats, Floats]:
    """Play angles without feed-forward; return times, setpoints and measured angles.

    Leaves out beginning and end, where the speed override makes the samples uneven.
    """
    config = simulated("virtual")
    unknown = tuple(structs.replace(axis, lag_s=0.0, lag2_s2=0.0, friction_deg=0.0) for axis in config.axes)
    times = np.arange(len(setpoint_deg)) * STEP_S
    load = Load(
        run_id="run",
        recording_id="recording",
        times_s=times.astype("<f8").tobytes(),
        angles_deg=setpoint_deg.astype("<f8").tobytes(),
        method="smooth",
    )
    run = VirtualStation(structs.replace(config, axes=unknown), seed).play(load, float(times[-1]))
    even = (run.phase == PHASE_PLAYING) & (run.path_s > 1.0) & (run.path_s < times[-1] - 1.0)
    places = run.path_s[even]
    return places, Trajectory(times, setpoint_deg).along(places), run.measured_deg[even].astype(np.float64)


def test_known_lag_is_identified() -> None:
    """The movement follows the model exactly; the noise is that of an encoder's steps."""
    times = np.arange(0, 30, 0.01)
    measured = 20 * np.sin(math.tau * 0.2 * times) + 5 * np.sin(math.tau * 0.9 * times)
    speed, acceleration = np.gradient(measured, times), np.gradient(np.gradient(measured, times), times)
    setpoint = measured + 0.08 * speed + 0.004 * acceleration + 0.3 * np.tanh(speed / FRICTION_REVERSAL_DEG_S) + 1.5
    noise = np.random.default_rng(1).uniform(-0.044, 0.044, times.shape)
    (found,) = identify(times, setpoint[:, None], (measured + noise)[:, None])
    assert found.lag_s == pytest.approx(0.08, abs=0.001)
    assert found.lag2_s2 == pytest.approx(0.004, abs=0.0003)
    assert found.friction_deg == pytest.approx(0.3, abs=0.03)
    assert found.residual_deg < 0.05


@pytest.mark.parametrize("seed", [None, 3])
def test_lag_of_simulated_drives_depends_only_on_their_control(seed: int | None) -> None:
    found = identify(*played(exercise(15.0, 7), seed))
    for axis, drive, joint in zip(found, DRIVES, JOINTS, strict=True):
        # Friction at the reversals reduces the identified lag a little.
        assert axis.lag_s == pytest.approx(drive.d_nm_s_rad / drive.p_nm_rad + GOAL_SMOOTHING_S, rel=0.12)
        assert 0.0 < axis.lag2_s2 < 0.01
        coulomb_deg = math.degrees((joint.rotor_coulomb_nm + joint.arm_coulomb_nm) / drive.p_nm_rad)
        assert 0.0 < axis.friction_deg < 1.5 * coulomb_deg
        assert axis.residual_deg < 0.25


def test_the_simulated_station_knows_the_lag_of_its_drives() -> None:
    for axis, found in zip(
        simulated("virtual").axes, identify(*played(exercise(20.0, 1, 2, 4, 5, 6), None)), strict=True
    ):
        assert axis.lag_s == pytest.approx(found.lag_s, abs=0.003)
        assert axis.lag2_s2 == pytest.approx(found.lag2_s2, abs=0.0005)
        assert axis.friction_deg == pytest.approx(found.friction_deg, abs=0.05)


def test_samples_without_information_are_refused() -> None:
    times = np.arange(0, 5, 0.01)
    wave = np.sin(times)[:, None] * 10
    with pytest.raises(ValueError, match="evenly spaced"):
        identify(np.where(times > 2, times + 1, times), wave, wave)
    with pytest.raises(ValueError, match="motor 1 did not move"):
        identify(times, wave, np.zeros_like(wave))
    with pytest.raises(ValueError, match="hundred"):
        identify(times[:50], wave[:50], wave[:50])
    with pytest.raises(ValueError, match="as many setpoints"):
        identify(times, wave, wave[:-1])
