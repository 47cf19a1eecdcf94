"""The reference of each method: smoothing, the zero-order hold, and the feed-forward."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kata.motion.arm_load import ArmLoad
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.method import FeedForward, LoadModel, ServoModel, reference
from kata.motion.path import PathPoint
from kata.motion.smoothing import smoothed
from kata.motion.taught import Taught, read_csv
from kata.motion.trajectory import Trajectory

COUNT_DEG = 360 / 4096


def motions() -> list[Taught]:
    folder = os.environ.get("KATA_TAUGHT")
    files = sorted(Path(folder).glob("*.csv")) if folder else []
    return [*built_in_motions(), *map(read_csv, files)]


def as_measured(angles_deg: Floats) -> Floats:
    """Round the angles to encoder counts."""
    return np.round(angles_deg / COUNT_DEG) * COUNT_DEG


@pytest.mark.parametrize("every", [1, 2, 10], ids=["100 Hz", "50 Hz", "10 Hz"])
@pytest.mark.parametrize("taught", motions(), ids=lambda taught: taught.name)
def test_smoothing_preserves_the_taught_motion(taught: Taught, every: int) -> None:
    """0.2 deg are allowed. Smoothing changes at most a third of that, at 10 Hz too."""
    angles = motor_angles_deg(taught.poses_deg)
    recorded = as_measured(angles)[::every]
    trajectory = Trajectory(taught.times_s[::every], recorded)
    assert trajectory.rmse_deg.max() <= 0.08
    # The difference to the arm's true path, which the encoder never reported, is not larger either.
    off = trajectory.along(taught.times_s[::every] - taught.times_s[0]) - angles[::every]
    assert np.sqrt(np.mean(off**2)) <= 0.05


@pytest.mark.parametrize("taught", motions(), ids=lambda taught: taught.name)
def test_time_stamps_need_not_be_even(taught: Taught) -> None:
    chosen = np.sort(np.random.default_rng(1).permutation(len(taught.times_s))[: len(taught.times_s) // 2])
    angles = motor_angles_deg(taught.poses_deg)
    trajectory = Trajectory(taught.times_s[chosen], as_measured(angles[chosen]))
    grid = np.arange(0.0, trajectory.duration_s, 0.01)
    whole = Trajectory(taught.times_s, angles)
    assert np.abs(trajectory.along(grid) - whole.along(grid + taught.times_s[chosen[0]])).max() <= 0.3


def test_encoder_steps_add_little_noise_to_speed_and_acceleration() -> None:
    """The figures that determined the cut-off."""
    times = np.arange(0.0, 60.0, 0.01)
    noise = np.random.default_rng(0).uniform(-COUNT_DEG / 2, COUNT_DEG / 2, (len(times), 5))
    trajectory = Trajectory(times, noise)
    moving = [trajectory.motion_at(time_s) for time_s in np.arange(1.0, 59.0, 0.05)]
    assert np.std([motion.speed_deg_s for motion in moving]) == pytest.approx(0.17, rel=0.1)
    assert np.std([motion.acceleration_deg_s2 for motion in moving]) == pytest.approx(6.6, rel=0.1)


@pytest.mark.parametrize(("frequency_hz", "left"), [(1.0, 0.9992), (6.0, 0.5), (12.0, 1 / 17)])
def test_filter_halves_at_its_cut_off_and_shifts_no_time(frequency_hz: float, left: float) -> None:
    times = np.arange(0.0, 20.0, 0.005)
    wave = np.sin(2 * np.pi * frequency_hz * times)
    smooth = smoothed(times, wave[:, None], 6.0)[:, 0]
    middle = slice(1000, 3000)
    assert smooth[middle] == pytest.approx(left * wave[middle], abs=2e-3)


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_recording_of_few_samples_is_valid(samples: int) -> None:
    times = np.arange(samples) * 0.1
    trajectory = Trajectory(times, np.tile(times[:, None] * 10, 5))
    assert trajectory.at(0.05) == pytest.approx([0.5] * 5)


def test_a_gap_is_bridged_without_a_corner() -> None:
    times = np.arange(0.0, 4.0, 0.01)
    there = (times < 1.5) | (times > 2.3)
    angles = np.tile(20 * np.sin(times)[:, None], 5)
    trajectory = Trajectory(times[there], angles[there])
    assert trajectory.along(times) == pytest.approx(angles, abs=0.1)


# -- as the paper plays -----------------------------------------------------------------------------------------------


def test_the_paper_holds_each_tenth_of_a_second() -> None:
    times = np.arange(0.0, 1.04, 0.01)
    held = reference("paper", times, np.tile(times[:, None] * 10, 5))
    assert held.duration_s == pytest.approx(1.03)
    for time_s, angle in (
        (0.0, 0.0),
        (0.0999, 0.0),
        (0.1, 1.0),
        (0.3, 3.0),
        (0.39, 3.0),
        (1.0, 10.0),
        (7.0, 10.0),
        (-1.0, 0.0),
    ):
        motion = held.motion_at(time_s)
        assert motion.angles_deg == pytest.approx([angle] * 5)
        assert held.at(time_s) == pytest.approx([angle] * 5)
        assert not motion.speed_deg_s.any()
        assert not motion.acceleration_deg_s2.any()


def test_paper_method_sends_the_recorded_samples_at_ten_hertz() -> None:
    times = np.arange(31) * 0.1
    angles = np.random.default_rng(2).uniform(-5.0, 5.0, (31, 5))
    held = reference("paper", times, angles)
    assert held.along(np.asarray(times, dtype=np.float64)) == pytest.approx(angles)
    assert held.rmse_deg == pytest.approx([0.0] * 5, abs=1e-9)


def test_only_the_paper_holds() -> None:
    times = np.arange(0.0, 1.0, 0.01)
    angles = np.tile(times[:, None] * 10, 5)
    for method in ("smooth", "learned"):
        assert reference(method, times, angles).at(0.05) == pytest.approx([0.5] * 5)


# -- ahead of the drives ----------------------------------------------------------------------------------------------


def motion(speed_deg_s: float, acceleration_deg_s2: float = 0.0) -> PathPoint:
    return PathPoint(np.zeros(5), np.full(5, speed_deg_s), np.full(5, acceleration_deg_s2))


LAG = ServoModel(np.full(5, 0.06), np.full(5, 0.002), np.full(5, 0.5))


def test_setpoint_leads_by_the_drive_lag() -> None:
    assert LAG.feed_forward(motion(40.0)) == pytest.approx([40 * 0.06 + 0.5] * 5, abs=1e-3)
    assert LAG.feed_forward(motion(-40.0)) == pytest.approx([-40 * 0.06 - 0.5] * 5, abs=1e-3)
    assert LAG.feed_forward(motion(0.0, 100.0)) == pytest.approx([0.2] * 5)
    # Half a degree of friction causes no jump when the arm reverses.
    assert LAG.feed_forward(motion(5.0)) == pytest.approx([5 * 0.06 + 0.5 * np.tanh(1.0)] * 5)


def test_resting_arm_has_no_lead() -> None:
    assert not LAG.feed_forward(motion(0.0)).any()


def test_a_second_order_lag_is_undone() -> None:
    """u = r + a1 r' + a2 r'' through 1 / (1 + a1 s + a2 s2) is r."""
    lag = ServoModel(np.full(5, 0.08), np.full(5, 0.0025), np.zeros(5))
    times = np.arange(0.0, 4.0, 0.01)
    trajectory = Trajectory(times, np.tile(30 * (1 - np.cos(np.pi * times / 2))[:, None], 5))
    y, v, dt = np.zeros(5), np.zeros(5), 0.0005
    worst = 0.0
    for time_s in np.arange(0.0, 4.0, dt):
        r = trajectory.motion_at(time_s)
        v += (r.angles_deg + lag.feed_forward(r) - y - lag.first_s * v) / lag.second_s2 * dt
        y += v * dt
        worst = max(worst, float(np.abs(y - trajectory.at(time_s + dt)).max()))
    assert worst < 0.1


def test_a_drives_integral_and_the_weight_are_undone() -> None:
    """A PID drive with a motor that brakes by its own voltage, and a weight.

    By hand: P (e + sum(e) / T) = b y' + weight, so a1 = b / P, d = 1 / P.
    """
    p_nm_deg, brake_nm_s_deg, integral_s, inertia = 0.4, 0.05, 0.5, 0.0004
    model = ServoModel(
        np.full(5, brake_nm_s_deg / p_nm_deg),
        np.full(5, inertia / p_nm_deg),
        np.zeros(5),
        integral_s=np.full(5, integral_s),
        droop_deg_nm=np.full(5, 1 / p_nm_deg),
        load=LoadModel(arm=ArmLoad(inertia=(0.0,) * 8 + (-2.0 / 9.81, 0.0))),
    )
    times = np.arange(0.0, 4.0, 0.01)
    place = 20.0 * (1 - np.cos(np.pi * times / 2))
    turning = np.array([0.0, 0.0, 0.0, 1.0, 0.0])
    trajectory = Trajectory(times, motor_angles_deg(np.zeros(5)) + place[:, np.newaxis] * turning)
    step_s = 0.002

    def worst(ahead: FeedForward | None) -> float:
        angle, speed, held, found = 0.0, 0.0, 0.0, 0.0
        for time_s in np.arange(0.0, 4.0, step_s):
            motion = trajectory.motion_at(time_s)
            wanted = motion.angles_deg[3] + (ahead.at(motion)[3] if ahead else 0.0)
            error = wanted - angle
            held += error * step_s / integral_s
            load = 2.0 * np.sin(np.radians(angle)) + brake_nm_s_deg * speed
            speed += (p_nm_deg * (error + held) - load) / inertia * step_s
            angle += speed * step_s
            found = max(found, abs(angle - motion.angles_deg[3]))
        return found

    assert worst(None) > 1.0
    without_integral = replace(model, integral_s=np.zeros(5))
    assert worst(FeedForward(without_integral, step_s)) > 0.8
    assert worst(FeedForward(model, step_s)) < 0.1


def test_an_unidentified_load_is_no_torque() -> None:
    assert not LAG.load.known
    assert not LAG.load.torque_nm(motion(40.0)).any()


def test_torque_is_that_of_friction_inertia_and_arm() -> None:
    """A point mass of 1 kg, 0.4 m below the shoulder, raised sideways; motor 3's drive reports 10 % more than it gives."""
    point = ArmLoad(inertia=(0.0, 0.0, 0.16, 0.0, 0.0, 0.0, 0.0, 0.0, -0.4, 1.0))
    share = np.array([1.0, 1.0, 1.1, 1.0, 1.0])
    model = LoadModel(np.full(5, 0.01), np.full(5, 0.002), np.full(5, 0.3), share, point)
    raised = motor_angles_deg([0.0, 0.0, 90.0, 0.0, 0.0])
    turning = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    torque = model.torque_nm(PathPoint(raised, 40.0 * turning, 100.0 * turning))
    arm_nm = 9.81 * 0.4 + 0.16 * np.radians(100.0)
    assert torque[2] == pytest.approx(0.4 + 0.2 + 0.3 + 1.1 * arm_nm, abs=2e-3)
    # The arm cannot load motor 4, which turns about the arm's own line then, and loads the scapula beyond friction.
    assert torque[3] == pytest.approx(0.0, abs=2e-3)
    assert np.all(np.abs(torque[:2]) > 0.2)
