"""The limits of the pose in a run: every setpoint is inside of the reachable set and of the doctor's limits."""

import logging
from pathlib import Path

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, Load, Play
from kata.device.journal import JournalDisk, JournalWriter
from kata.device.references import Reference, build
from kata.device.run import Run
from kata.device.setpoint_gate import refused_setpoints
from kata.device.state_machine import StateMachine
from kata.motion import scapula_fit
from kata.motion.axes import N_AXES, Side
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import ArmLimits
from kata.motion.trajectory import Trajectory
from tests.support.journals import HEADER
from tests.support.playback import sent, station
from tests.support.poses import random_limits, random_poses, true_beyond_deg
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD, a_trajectory

log = logging.getLogger(__name__)

LAGGING = station(lag_s=0.1, lag2_s2=0.003, friction_deg=0.5)
TIMES_S = np.arange(0.0, 4.001, 0.01)
NINETY = ArmLimits(side_deg=90.0, front_deg=90.0)
SIDES: tuple[Side, ...] = ("right", "left")
_EXACT_DEG = 0.15
"""The gate tolerates 0.1 deg; the oracle uses the links themselves and not the fit."""


def asked(poses: Floats, arm: ArmLimits | None, side: Side = "right") -> Load:
    motors = motor_angles_deg(poses, side)
    return msgspec.structs.replace(
        LOAD,
        side=side,
        times_s=TIMES_S[: len(poses)].astype("<f8").tobytes(),
        angles_deg=motors.astype("<f8").tobytes(),
        arm_limits=arm,
        repetition_s=1.0,
    )


def swing(low: list[float], high: list[float]) -> Floats:
    """Return poses ``(n, 5)`` from one to the other and back in 4 s."""
    share = 0.5 - 0.5 * np.cos(np.pi * TIMES_S / 2)
    poses: Floats = np.array(low) + share[:, None] * (np.array(high) - np.array(low))
    return poses


def built(load: Load) -> Trajectory:
    found = build(load, LAGGING)
    assert isinstance(found, Reference), found
    return found.trajectory


# -- at Load ----------------------------------------------------------------------------------------------------------


def test_load_beyond_the_reachable_set_is_refused_with_its_place() -> None:
    refusal = build(asked(swing([0, 0, 90, 95, 0], [0, 0, 90, 185, 0]), None), LAGGING)
    assert not isinstance(refusal, Reference)
    assert "motor 4 would go to 185.0° at 2.0 s; in this pose the plane of elevation would be 185" in refusal.message


@pytest.mark.parametrize("abduction_deg", [44.0, 46.0])
def test_load_beyond_a_doctors_elevation_is_refused_in_every_pose(abduction_deg: float) -> None:
    load = asked(swing([0, 0, abduction_deg, 60, 0], [0, 0, abduction_deg, 120, 0]), NINETY)
    refusal = build(load, LAGGING)
    assert not isinstance(refusal, Reference)
    assert "elevation of the upper arm" in refusal.message
    assert isinstance(build(msgspec.structs.replace(load, arm_limits=None), LAGGING), Reference)


# -- setpoints --------------------------------------------------------------------------------------------------------


def played(folder: Path, load: Load, rest: tuple[float, ...] | None = None) -> Stepped:
    stepped = Stepped(folder, LAGGING)
    if rest:
        stepped.apparatus.angles_deg = list(rest)
    assert stepped.send(load, built(load)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused", 60.0)
    return stepped


def test_lead_of_the_setpoint_stays_inside_of_the_limits(tmp_path: Path) -> None:
    load = asked(swing([0, 0, 60, 0, 0], [0, 0, 60, 89.9, 0]), NINETY)
    stepped = played(tmp_path, load)
    stepped.send(Play())
    stepped.until("idle", 60.0)
    assert stepped.causes() == []
    written = np.array(stepped.apparatus.written)
    assert sent(stepped).max() > 89.8
    assert true_beyond_deg(pose_deg(written), "right", NINETY).max() < _EXACT_DEG


@pytest.mark.counted
def test_arm_outside_of_the_pose_limits_is_only_moved_inside(tmp_path: Path) -> None:
    load = asked(swing([0, 0, 60, 0, 0], [0, 0, 60, 40, 0]), NINETY)
    outside = motor_angles_deg([0.0, 0.0, 60.0, 130.0, 0.0])
    stepped = played(tmp_path, load, tuple(outside.tolist()))
    beyond = true_beyond_deg(pose_deg(np.array(stepped.apparatus.written)), "right", NINETY)
    assert beyond[0] > 15.0
    assert np.all(np.diff(beyond) < 0.05)
    run = stepped.loop._machine._run
    assert run is not None and run.return_to_deg is not None
    assert run.pose_beyond_deg(run.return_to_deg.tolist()) <= 0.0
    stepped.send(Play())
    stepped.until("idle", 60.0)
    assert stepped.causes() == []


@pytest.mark.counted
@pytest.mark.parametrize(("beyond_deg", "refused"), [(0.1, []), (0.1001, [("setpoint_limit", 3)])])
def test_last_check_of_a_pose_tolerates_a_tenth_degree(
    stepped: Stepped, monkeypatch: pytest.MonkeyPatch, beyond_deg: float, refused: list[tuple[str, int]]
) -> None:
    machine = stepped.loop._machine
    assert machine.refused_pose() == []  # Without a run there are no limits of the pose.
    assert stepped.send(LOAD, a_trajectory()) is None
    monkeypatch.setattr(Run, "pose_beyond_deg", lambda run, setpoint_deg: beyond_deg)
    assert machine.refused_pose() == refused


def test_polynomials_of_the_pose_are_fitted_before_the_first_cycle() -> None:
    scapula_fit.horner_coefficients.cache_clear()
    StateMachine(StationConfig(), lambda header: pytest.fail("no journal is opened"), lambda event: None)
    fitted = scapula_fit.horner_coefficients.cache_info()
    PoseGate("right", None, 0.15).beyond_deg((0.0,) * 5)
    assert scapula_fit.horner_coefficients.cache_info().misses == fitted.misses == 1


def test_setpoint_beyond_the_pose_limits_is_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load = asked(swing([0, 0, 60, 0, 0], [0, 0, 60, 89.9, 0]), NINETY)
    stepped = played(tmp_path, load)
    monkeypatch.setattr(PoseGate, "held", lambda self, angles, *rest: angles)
    stepped.send(Play())
    stepped.until("stopped", 60.0)
    stop = stepped.snapshot.stop
    assert stop is not None
    # The fault of a pose names motor 4.
    assert ("setpoint_limit", 4) in [(cause.code, cause.axis) for cause in stop.causes]


# -- properties -------------------------------------------------------------------------------------------------------


def a_run(folder: Path, load: Load, trajectory: Trajectory, config: StationConfig) -> Run:
    return Run(load, trajectory, JournalWriter(folder, HEADER, JournalDisk()), config)


def random_path(rng: np.random.Generator) -> Floats:
    """Return poses ``(n, 5)`` that wander around a random pose, within the ranges of the motors."""
    middle = random_poses(rng, 1)[0]
    turns, begin = rng.uniform(0.1, 0.8, N_AXES), rng.uniform(0.0, 2 * np.pi, N_AXES)
    sizes = rng.uniform(0.0, 1.0) * np.array([6.0, 6.0, 15.0, 15.0, 10.0]) * rng.uniform(0.2, 1.0, N_AXES)
    poses: Floats = middle + sizes * np.sin(2 * np.pi * TIMES_S[:, None] * turns / 2 + begin)
    return poses


def play_randomly(folder: Path, rng: np.random.Generator, side: Side) -> tuple[int, str]:
    """Play one random path of one arm with pauses, reversals and a reduced range, and check each setpoint. Return their number
    and the result.
    """
    config = msgspec.structs.replace(LAGGING, side=side)
    poses, arm = random_path(rng), random_limits(rng) if rng.random() < 0.7 else None
    truth = true_beyond_deg(poses, side, None)
    beyond = float(truth.max()) - config.pose_tolerance_deg
    if arm:
        beyond = max(beyond, float(true_beyond_deg(poses, side, arm).max()))
    load = asked(poses, arm, side)
    found = build(load, config)
    if not isinstance(found, Reference):
        if "its limit is" in found.message:
            assert beyond > -0.5, f"refused {-beyond:.2f} deg inside: {found.message}"
            return 0, "refused"
        return 0, "other limit"
    assert beyond < _EXACT_DEG, f"accepted {beyond:.2f} deg beyond"
    run = a_run(folder, load, found.trajectory, config)
    run.start_path(found.trajectory.start_deg)
    movement = run.movement_along(found.trajectory, direction=1)
    setpoints = [tuple(found.trajectory.start_deg.tolist())]
    while not movement.ended and len(setpoints) < 1000:
        if rng.random() < 0.02:
            run.range_override.reduce()
        if rng.random() < 0.01:
            movement.direction = int(rng.choice([-1, 0, 1, 1, 1]))  # type: ignore[assignment]
        elif movement.at_rest:
            movement.direction = 1
        setpoint = run.setpoint(movement)
        refused = refused_setpoints(setpoints[-2:], setpoint, run.limits_deg, run.config, run.rate_hz)
        assert refused == [], f"{refused} after {len(setpoints)} setpoints"
        setpoints.append(setpoint)
        movement.advance(0.01)
    reached = pose_deg(np.array(setpoints), side)
    assert true_beyond_deg(reached, side, None).max() <= config.pose_tolerance_deg + _EXACT_DEG
    assert arm is None or true_beyond_deg(reached, side, arm).max() <= _EXACT_DEG
    return len(setpoints), "played"


@pytest.mark.parametrize("side", SIDES)
def test_no_setpoint_of_a_random_path_leaves_the_limits(tmp_path: Path, side: Side) -> None:
    rng = np.random.default_rng([11, SIDES.index(side)])
    results = [play_randomly(tmp_path, rng, side)[1] for _ in range(40)]
    assert results.count("played") > 3
    assert results.count("refused") > 3


def check_poses(rng: np.random.Generator, count: int) -> tuple[int, int]:
    """Compare the gate's and the check's answer for random poses with the oracle. Return how many are allowed and not."""
    allowed = refused = 0
    while allowed + refused < count:
        arm, side = random_limits(rng), rng.choice(["right", "left"])
        poses = random_poses(rng, min(2000, count))
        truth = np.maximum(
            true_beyond_deg(poses, side, None) - LAGGING.pose_tolerance_deg, true_beyond_deg(poses, side, arm)
        )
        gate = PoseGate(side, arm, LAGGING.pose_tolerance_deg)
        found = np.array([gate.beyond_deg(row) for row in motor_angles_deg(poses, side).tolist()])
        assert truth[found <= 0.0].max(initial=-1.0) < _EXACT_DEG
        assert truth[found > 0.0].min(initial=1.0) > -0.5
        allowed += int(np.sum(found <= 0.0))
        refused += int(np.sum(found > 0.0))
    return allowed, refused


def test_no_pose_is_wrongly_allowed_or_refused() -> None:
    allowed, refused = check_poses(np.random.default_rng(12), 4000)
    assert min(allowed, refused) > 200


def play_many(folder: Path, rng: np.random.Generator, side: Side, least: int) -> tuple[int, dict[str, int]]:
    """Play random paths of one arm until at least so many setpoints were checked. Return their number and the paths by result."""
    results: dict[str, int] = {}
    setpoints = 0
    while setpoints < least:
        count, result = play_randomly(folder, rng, side)
        setpoints += count
        results[result] = results.get(result, 0) + 1
    return setpoints, results


@pytest.mark.campaign
@pytest.mark.timeout(0)
def test_a_million_poses_are_neither_wrongly_allowed_nor_refused() -> None:
    allowed, refused = check_poses(np.random.default_rng(13), 1_000_000)
    log.info("%d poses allowed, %d refused", allowed, refused)
    assert min(allowed, refused) > 50_000


@pytest.mark.campaign
@pytest.mark.timeout(0)
@pytest.mark.parametrize("side", SIDES)
def test_a_million_setpoints_of_each_arm_stay_inside(tmp_path: Path, side: Side) -> None:
    setpoints, results = play_many(tmp_path, np.random.default_rng([13, SIDES.index(side)]), side, 1_000_000)
    log.info("%s arm: %d setpoints, paths %s", side, setpoints, results)
    assert min(results["played"], results["refused"]) > 100
