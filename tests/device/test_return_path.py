"""The arm returns from every place of a recording within the limits of its pose, if need be back along the recording."""

from collections.abc import Iterator
from functools import cache
from itertools import chain, pairwise, product, repeat
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec import structs

from kata.device import state_machine_base
from kata.device.approach_and_return import straight_return_path
from kata.device.config import simulated
from kata.device.ipc_messages import Approach, Load, Pause, Play, ReduceRange, Refusal, Return
from kata.device.journal import JournalDisk, JournalWriter
from kata.device.movement import Movement
from kata.device.references import Reference, build
from kata.device.run import Run
from kata.device.run_limits import PATH_TOLERANCE_DEG, RunLimits
from kata.motion.approach import MinimumJerkMove, PathSequence
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.method import reference
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import POSE_ROUNDING_DEG, ArmLimits
from tests.support.examples import examples
from tests.support.journals import HEADER
from tests.support.poses import random_limits, random_poses, true_beyond_deg
from tests.support.simulated_loop import load_of
from tests.support.stepped import REST_DEG, Stepped

CONFIG = structs.replace(simulated("memory"), silence_ms=100)
_EXACT_DEG = 0.15
"""The gate tolerates 0.1 deg; the oracle uses the links themselves and not the fit."""
_TRIES = 200


class Motion(NamedTuple):
    """The poses of a recording, ``(5,)`` in motor angles, and where the arm is before it is approached."""

    here_deg: Floats
    poses_deg: list[Floats]
    limits: ArmLimits

    def load(self) -> Load:
        """Return the Load: minimum-jerk movements from pose to pose."""
        path = PathSequence(
            [MinimumJerkMove(a, b, 35.0) for a, b in zip(self.poses_deg, self.poses_deg[1:], strict=False)]
        )
        times = np.arange(0.0, path.duration_s, 0.01)
        angles = np.array([path.motion_at(time).angles_deg for time in times])
        return load_of(times, angles, arm_limits=self.limits)


@cache
def around_a_corner(seed: int) -> Motion | None:
    """Return a motion within a doctor's limits from whose end the straight path back exceeds the limits, or None if none was found."""
    rng = np.random.default_rng(seed)
    for _ in range(_TRIES):
        limits = random_limits(rng)
        poses = random_poses(rng, 300)
        poses[100:, 2:4] = rng.uniform((0.0, 90.0), (90.0, 188.0), (200, 2))
        beyond = np.maximum(true_beyond_deg(poses, "right", None), true_beyond_deg(poses, "right", limits))
        inside = motor_angles_deg(poses[beyond < -0.5], "right")
        if len(inside) < 3:
            continue
        corners = list(inside[rng.integers(len(inside), size=3)])
        hanging = motor_angles_deg(np.zeros(5), "right")
        here = hanging + rng.random() * (corners[0] - hanging)
        gate = PoseGate("right", limits, CONFIG.pose_tolerance_deg)
        run_limits = RunLimits(CONFIG.mechanism_deg, (), CONFIG.limit_tolerance_deg, gate)
        # Few poses are enough to leave out most tries. The paths in full take a hundred times as long.
        between = [a + share * (b - a) for a, b in pairwise([here, *corners]) for share in (0.0, 0.5, 0.25, 0.75)]
        if any(gate.beyond_deg(pose.tolist()) > 0.0 for pose in between):
            continue
        if run_limits.path_excess_deg(corners[-1], here) > 0.3 and run_limits.path_excess_deg(here, *corners) == 0.0:
            return Motion(here, corners, limits)
    return None


def returned(folder: Path, motion: Motion, method: str, paused_at: float | None, reduced: bool) -> Stepped | None:
    """Play to a place, return from there, and return the station. None if the motion is refused.

    ``paused_at``: share of the recording at which the therapist pauses and returns; None: play to the end. ``reduced``: the range is
    reduced on the way.
    """
    load = structs.replace(motion.load(), method=method)
    reference = build(load, CONFIG)
    if isinstance(reference, Refusal):
        return None
    station = Stepped(folder, CONFIG)
    station.apparatus.angles_deg = motion.here_deg.tolist()
    station.forward(0.1)
    assert station.send(load, reference.trajectory) is None
    if station.send(Approach()):
        return None
    station.until("paused", 120.0)
    assert station.send(Play()) is None
    if reduced:
        station.forward(0.2)
        station.send(ReduceRange())
    if paused_at is not None:
        station.forward(max(0.0, paused_at * reference.trajectory.duration_s - 0.2))
        assert station.send(Pause()) is None
        station.until("paused", 10.0)
        assert station.send(Return()) is None
    station.until("idle", 600.0)
    return station


def check_returned(station: Stepped, motion: Motion) -> None:
    """Check that no setpoint left the doctor's limits, and that the arm is where it was."""
    written = np.array(station.apparatus.written)
    assert true_beyond_deg(pose_deg(written), "right", motion.limits).max() < _EXACT_DEG
    assert np.abs(written[-1] - motion.here_deg).max() < 1.0


@pytest.mark.parametrize(
    ("seed", "paused_at", "reduced"),
    [(2, 0.91, False), pytest.param(36, None, False, marks=pytest.mark.counted), (175, None, True)],
)
def test_arm_returns_where_the_straight_path_leaves_the_limits(
    tmp_path: Path, seed: int, paused_at: float | None, reduced: bool
) -> None:
    """With a reduced range the recording itself left the limits."""
    motion = around_a_corner(seed)
    assert motion is not None
    station = returned(tmp_path, motion, "smooth", paused_at, reduced)
    assert station is not None
    check_returned(station, motion)


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["smooth", "smooth", "paper"]),
    st.one_of(st.none(), st.floats(0.0, 1.0)),
    st.booleans(),
)
@examples(few=3, many=1_000)
def test_arm_returns_from_every_place_of_a_recording(
    tmp_path_factory: pytest.TempPathFactory, seed: int, method: str, paused_at: float | None, reduced: bool
) -> None:
    motion = around_a_corner(seed)
    if motion is None:
        return
    if method == "paper":
        # The paper's method starts close to the recording's start only.
        motion = motion._replace(here_deg=motion.poses_deg[0])
    station = returned(tmp_path_factory.mktemp("return"), motion, method, paused_at, reduced)
    if station is not None:
        check_returned(station, motion)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
@examples(few=3, many=1_000)
def test_range_is_only_reduced_to_shares_within_the_limits(seed: int, place: float) -> None:
    motion = around_a_corner(seed)
    reference = build(motion.load(), CONFIG) if motion else None
    if motion is None or not isinstance(reference, Reference):
        return
    trajectory = reference.trajectory
    gate = PoseGate("right", motion.limits, CONFIG.pose_tolerance_deg)
    least = float(trajectory.least_share)
    shares = least + (1.0 - least) * np.linspace(0.0, 1.0, 30)
    from_rest_deg = trajectory.at(place * trajectory.duration_s) - trajectory.rest_deg
    beyond = [gate.beyond_deg((trajectory.rest_deg + share * from_rest_deg).tolist()) for share in shares]
    assert max(beyond) < _EXACT_DEG


def begun_outside(folder: Path, seed: int) -> Iterator[tuple[Run, Floats]]:
    """Yield runs whose approach has begun outside a doctor's limits and only leads inwards, with the recording's start."""
    rng = np.random.default_rng(seed)
    limits, poses = random_limits(rng), random_poses(rng, 60)
    beyond = np.maximum(true_beyond_deg(poses, "right", None), true_beyond_deg(poses, "right", limits))
    outside, inside = (motor_angles_deg(poses[chosen], "right")[:4] for chosen in (beyond > 2.0, beyond < -0.5))
    for here_deg, start_deg in product(outside, inside):
        still_deg = np.array([start_deg, start_deg])
        load = load_of([0.0, 1.0], still_deg, arm_limits=limits)
        trajectory = reference("smooth", [0.0, 1.0], still_deg)
        run = Run(load, trajectory, JournalWriter(folder, HEADER, JournalDisk()), CONFIG)
        if run.limits.path_excess_deg(here_deg, start_deg) == 0.0:
            run.begin(here_deg)
            yield run, start_deg


@given(st.integers(0, 2**32 - 1))
@example(1)
@example(22)
@examples(few=3, many=300)
def test_arm_from_outside_the_limits_returns_to_a_pose_inside(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    """The straight path from the start to the nearest pose inside may leave the limits in between."""
    for run, start_deg in begun_outside(tmp_path_factory.mktemp("run"), seed):
        back_deg = run.return_to_deg
        assert back_deg is not None
        tight = RunLimits(CONFIG.mechanism_deg, (), CONFIG.limit_tolerance_deg, run._gate)
        assert tight.path_excess_deg(start_deg, back_deg) <= PATH_TOLERANCE_DEG
        assert run._gate.beyond_deg(back_deg.tolist()) <= POSE_ROUNDING_DEG


def answer_straight(monkeypatch: pytest.MonkeyPatch, answers: Iterator[bool]) -> None:
    """Let the control program look for the straight path and find it, or not, by these answers."""
    monkeypatch.setattr(
        state_machine_base,
        "straight_return_path",
        lambda run, here: straight_return_path(run, here) if next(answers) else None,
    )


@pytest.mark.counted
def test_arm_goes_on_back_after_resting_too_early(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    """The straight path was free when the arm began to slow down, and no more where it came to rest."""
    answer_straight(monkeypatch, chain([False, True, False], repeat(True)))
    playing.forward(1.0)
    assert playing.send(Pause()) is None
    playing.until("paused")
    paused_deg = np.array(playing.apparatus.written[-1])
    assert playing.send(Return()) is None
    playing.until("idle", 60.0)
    assert playing.causes() == []
    assert np.allclose(playing.apparatus.written[-1], REST_DEG, atol=0.1)
    assert np.abs(paused_deg - REST_DEG).max() > 20.0


@pytest.mark.counted
def test_arm_returns_through_the_start_if_no_path_is_straight(
    playing: Stepped, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer_straight(monkeypatch, repeat(False))
    start_deg = np.array(REST_DEG)
    start_deg[3] = 20.0
    playing.forward(1.0)
    assert playing.send(ReduceRange()) is None
    playing.forward(0.3)
    assert playing.send(Pause()) is None
    playing.until("paused")
    count = len(playing.apparatus.written)
    assert playing.send(Return()) is None
    playing.until("idle", 60.0)
    assert playing.causes() == []
    back = np.array(playing.apparatus.written[count:])
    assert np.abs(back - start_deg).max(axis=1).min() < 0.5
    assert np.allclose(back[-1], REST_DEG, atol=0.1)
    assert np.abs(np.diff(back, axis=0)).max() * playing.config.rate_hz < 1.1 * playing.config.approach_speed_deg_s


def _returning(station: Stepped) -> Movement:
    """Pause a second after the start, and return. Return the movement along the recording."""
    station.forward(1.0)
    assert station.send(Pause()) is None
    station.until("paused")
    assert station.send(Return()) is None
    movement = station.loop._machine._movement
    assert movement is not None
    return movement


@pytest.mark.counted
def test_returning_arm_looks_for_a_straight_path_regularly(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at: list[int] = []

    def looked() -> Iterator[bool]:
        while True:
            looked_at.append(playing.loop._machine._cycles_on_path)
            yield False

    answer_straight(monkeypatch, looked())
    _returning(playing)
    playing.forward(1.0)
    assert playing.mode == "returning"
    # The first look is that of the command. The others are in cycles with a setpoint at every rate.
    assert set(np.diff(looked_at[1:])) == {10}
    assert {cycles % 10 for cycles in looked_at[1:]} == {0}


def test_remaining_time_of_a_return_counts_in_seconds(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm moves back along the recording with half of its speed."""
    answer_straight(monkeypatch, repeat(False))
    _returning(playing)
    left_s = []
    for _ in range(2):
        playing.forward(1.0)
        assert playing.snapshot.run is not None
        left_s.append(playing.snapshot.run.left_s)
    assert left_s[0] - left_s[1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.counted
def test_returning_arm_rests_before_it_leaves_the_recording(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    answer_straight(monkeypatch, chain([False, False], repeat(True)))
    movement = _returning(playing)
    before = len(playing.apparatus.written)
    playing.until("idle", 60.0)
    assert movement.direction == 0
    assert movement.at_rest
    # A full stop within one setpoint would be 15 deg/s in 0.01 s, 1,500 deg/s2.
    accelerations = np.diff(np.array(playing.apparatus.written[before:]), 2, axis=0) * playing.config.rate_hz**2
    assert np.abs(accelerations).max() < 300.0


@pytest.mark.counted
def test_arm_leaves_no_path_while_its_setpoint_leads(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    answer_straight(monkeypatch, chain([False], repeat(True)))
    playing.forward(1.0)
    assert playing.send(Pause()) is None
    playing.until("paused")
    with monkeypatch.context() as leading:
        leading.setattr(Run, "may_leave_path", False)
        assert playing.send(Return()) is None
        movement = playing.loop._machine._movement
        assert movement is not None
        # It moves back without waiting, and rests where the straight path is free.
        assert movement.direction == -1
        playing.forward(2.0)
        assert movement.at_rest
        assert playing.loop._machine._movement is movement
    playing.cycle()
    assert playing.loop._machine._movement is not movement


@pytest.mark.counted
def test_arm_leaves_no_start_while_its_setpoint_leads(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    answer_straight(monkeypatch, repeat(False))
    movement = _returning(playing)
    monkeypatch.setattr(Run, "may_leave_path", False)
    playing.forward(20.0)
    assert movement.ended
    assert playing.loop._machine._movement is movement


# -- along the recording ------------------------------------------------------------------------------------------

_AROUND_A_CORNER_SEED = 2


def _motion(repetitions: int) -> Motion:
    """Return a motion that ends where the straight path back leaves the limits. Each repetition after the first goes back and out again."""
    motion = around_a_corner(_AROUND_A_CORNER_SEED)
    assert motion is not None
    out = motion.poses_deg
    return motion._replace(poses_deg=[*out, *(out[-2::-1] + out[1:]) * (repetitions - 1)])


def _forward_to(station: Stepped, mode: str, within_s: float) -> None:
    for _ in range(round(within_s)):
        station.link.journals[-1].write()
        for _ in range(100):
            if station.mode == mode:
                return
            station.cycle()
    assert station.mode == mode, station.causes()


def _returned(folder: Path, motion: Motion, paused_before_end_s: float) -> Floats:
    """Play, pause shortly before the end, and return. Return the setpoints of the return, ``(n, 5)``."""
    load = motion.load()
    reference = build(load, CONFIG)
    assert not isinstance(reference, Refusal)
    station = Stepped(folder, CONFIG)
    station.apparatus.angles_deg = motion.here_deg.tolist()
    station.forward(0.1)
    assert station.send(load, reference.trajectory) is None
    assert station.send(Approach()) is None
    _forward_to(station, "paused", 60.0)
    assert station.send(Play()) is None
    for n in range(round(100 * (reference.trajectory.duration_s - paused_before_end_s))):
        station.cycle()
        if n % 1000 == 0:
            station.link.journals[-1].write()
    assert station.send(Pause()) is None
    _forward_to(station, "paused", 5.0)
    before = len(station.apparatus.written)
    assert station.send(Return()) is None
    _forward_to(station, "idle", 300.0)
    return np.array(station.apparatus.written[before - 1 :])


def test_return_along_recording_keeps_approach_speed(tmp_path: Path) -> None:
    setpoints_deg = _returned(tmp_path, _motion(1), 0.4)
    # Over 0.2 s, because the feed-forward changes within some setpoints where the arm starts and turns.
    fastest_deg_s = float(np.abs(setpoints_deg[20:] - setpoints_deg[:-20]).max()) / 0.2
    assert fastest_deg_s < 1.05 * CONFIG.approach_speed_deg_s


def test_return_along_recording_repeats_no_repetition(tmp_path: Path) -> None:
    motion = _motion(2)
    setpoints_deg = _returned(tmp_path, motion, 0.4)
    travelled_deg = float(np.abs(np.diff(setpoints_deg, axis=0)).max(axis=1).sum())
    once = np.array([motion.here_deg, *_motion(1).poses_deg])
    once_deg = float(np.abs(np.diff(once, axis=0)).max(axis=1).sum())
    assert travelled_deg < 1.2 * once_deg
