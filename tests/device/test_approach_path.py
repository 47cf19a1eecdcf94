"""An approach is refused if its straight path leads beyond the limits of the arm's pose, where the setpoint could jump."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from kata.device.config import Inputs, StationConfig, simulated
from kata.device.ipc_messages import Approach, Refusal
from kata.device.references import build
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.reach import ArmLimits
from tests.support.examples import examples
from tests.support.poses import random_poses, true_beyond_deg
from tests.support.simulated_loop import SimulatedLoop, load_of
from tests.support.stepped import Stepped

_OVERHEAD = [
    # The arm is within reach.
    ([12.2, 103.7, 8.1, 184.6, -62.3], [20.5, 110.3, 109.8, 10.1, 4.5]),
    # A hand has led the arm beyond its reach.
    ([9.8, 119.6, 22.9, 181.9, -76.2], [3.5, 116.2, 25.1, 65.3, -71.4]),
    ([28.1, 122.1, 24.9, 176.5, 21.2], [22.6, 114.9, 45.0, 124.9, 4.8]),
    ([17.2, 122.3, 24.9, 173.0, -79.2], [-5.1, 121.5, 88.8, 75.8, 24.2]),
]


def _config(cycle_hz: int) -> StationConfig:
    inputs = Inputs(estop_second_port=3, max_age_cycles=5)
    return structs.replace(simulated("memory"), cycle_hz=cycle_hz, rate_hz=cycle_hz, silence_ms=100, inputs=inputs)


def _approach(folder: Path, cycle_hz: int, here_deg: Floats, start_deg: Floats) -> tuple[SimulatedLoop, str]:
    """Approach a recording that holds the start, from a pose. Return the station, and the code of the refusal or ""."""
    station = SimulatedLoop(folder, _config(cycle_hz))
    times = np.arange(0.0, 1.01, 0.01)
    refusal = station.send(load_of(times, np.tile(start_deg, (len(times), 1))))
    if refusal is None:
        for _ in range(2):
            station.place(here_deg)
            station.tick()
        refusal = station.send(Approach())
    return station, refusal.code if refusal else ""


@pytest.mark.counted
@pytest.mark.parametrize(("here", "start"), _OVERHEAD)
@pytest.mark.parametrize("cycle_hz", [100, 50])
def test_approach_from_overhead_arrives_or_is_refused(
    tmp_path: Path, cycle_hz: int, here: list[float], start: list[float]
) -> None:
    _, refusal = _approach(tmp_path, cycle_hz, np.array(here), np.array(start))
    assert refusal == "way_leaves_limits"


@given(st.integers(0, 2**32 - 1), st.sampled_from([100, 50]), st.booleans())
@examples(few=4, many=1_000)
def test_accepted_approach_from_anywhere_arrives(
    tmp_path_factory: pytest.TempPathFactory, seed: int, cycle_hz: int, overhead: bool
) -> None:
    """From any pose that hands can reach, often overhead or across the body, to any start within reach."""
    rng = np.random.default_rng(seed)
    poses = random_poses(rng, 60)
    start = motor_angles_deg(poses[np.argmin(true_beyond_deg(poses, "right", None))], "right")
    pose = random_poses(rng, 1)[0]
    if overhead:
        pose[2:4] = rng.uniform(0.0, 60.0), rng.uniform(120.0, 188.0)
    config = _config(cycle_hz)
    command = load_of(np.array([0.0, 0.5, 1.0]), np.tile(start, (3, 1)))
    built = build(command, config)
    if isinstance(built, Refusal):
        return
    stepped = Stepped(tmp_path_factory.mktemp("approach"), config)
    stepped.apparatus.angles_deg = motor_angles_deg(pose, "right").tolist()
    stepped.forward(0.1)
    assert stepped.send(command, built.trajectory) is None
    refusal = stepped.send(Approach())
    if refusal:
        assert refusal.code in ("way_leaves_limits", "outside_range")
        return
    stepped.until("paused")
    assert stepped.causes() == []


def test_approach_is_straight_where_its_side_of_arrival_is_outside(tmp_path: Path) -> None:
    """Every axis arrives from its own side unless only the straight path stays within the limits."""
    here, start, away = (
        np.array(angles)
        for angles in (
            [18.4, 110.7, 3.8, 15.9, -4.2],
            [35.2, 119.4, 22.6, 95.1, -25.2],
            [37.2, 123.0, 5.8, 124.4, -45.8],
        )
    )
    limits = ArmLimits(
        scapula_deg=((-19.1, 1.06), (-18.66, 19.51)),
        side_deg=51.86,
        front_deg=158.52,
        back_deg=51.86,
        plane_deg=(-10.02, 77.88),
        flexion_from_deg=(-4.3, -20.0),
    )
    times = np.arange(0.0, 6.0, 0.01)
    share = 0.5 - 0.5 * np.cos(np.pi * times / 6.0)
    station = SimulatedLoop(tmp_path, _config(100))
    assert station.send(load_of(times, start + share[:, None] * (away - start), arm_limits=limits)) is None
    for _ in range(2):
        station.place(here)
        station.tick()
    assert station.send(Approach()) is None
    station.until("paused")
    assert station.causes() == []


def test_approach_from_the_hanging_arm_is_accepted(tmp_path: Path) -> None:
    station, refusal = _approach(
        tmp_path, 100, np.array([15.0, 109.0, 10.0, 0.0, 0.0]), np.array([17.0, 107.0, 40.0, 60.0, -20.0])
    )
    assert refusal == ""
    station.until("paused")
