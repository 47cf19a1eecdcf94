"""Every setpoint of whole treatments stays within the limits of the pose.

The device's own code builds the reference, and the control loop approaches, plays, pauses, reduces the range and returns. An independent account by
vectors (:mod:`tests.support.poses`) judges every setpoint that was sent to the drives.
"""

import logging
from collections import Counter
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import pytest
from msgspec import structs

from kata.device.ipc_messages import Approach, Load, Pause, Play, ReduceRange, Refusal, Return
from kata.device.references import Reference, build
from kata.motion.axes import N_AXES, Side
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.method import Method
from kata.motion.reach import ArmLimits
from tests.support.playback import station as fast_station
from tests.support.poses import random_limits, random_poses, true_beyond_deg
from tests.support.simulated_loop import load_of
from tests.support.stepped import Stepped

log = logging.getLogger(__name__)


@pytest.fixture(autouse=True)
def quiet_device(caplog: pytest.LogCaptureFixture) -> None:
    """Leave the device's own lines out of the campaign's log."""
    caplog.set_level(logging.WARNING, "kata.device")


CONFIG: Final = fast_station(lag_s=0.1, lag2_s2=0.003, friction_deg=0.5)
"""The setpoints of a station with a large lag lead the reference most."""
SIDES: Final[tuple[Side, ...]] = ("right", "left")
METHODS: Final[tuple[Method, ...]] = ("smooth", "smooth", "smooth", "learned", "paper")
_EXACT_DEG: Final = 0.15
"""The gate tolerates 0.1 deg; the oracle uses the links themselves and not the fit."""
_FALSE_REFUSAL_DEG: Final = 0.5
"""A motion that stays this far inside must not be refused."""
_CANDIDATES: Final = 300
_BESIDE_DEG: Final = 8.0
"""Distance to a limit of the middle of half of the motions."""
_HALVINGS: Final = 12
_WAIT_S: Final = 300.0
_LOGGED: Final = 50
"""Treatments between two lines of the log."""


class Treatment(NamedTuple):
    """The poses of a recording, ``(n, 5)`` at 100 Hz, the doctor's limits, and the arm's angles before the approach."""

    side: Side
    poses: Floats
    arm: ArmLimits | None
    here_deg: Floats
    method: Method

    @property
    def load(self) -> Load:
        """Return the Load of the recording."""
        times = np.arange(len(self.poses)) * 0.01
        motors = motor_angles_deg(self.poses, self.side)
        return load_of(
            times, motors, side=self.side, arm_limits=self.arm, method=self.method, repetition_s=float(times[-1]) / 2
        )

    def beyond_deg(self, poses: Floats) -> Floats:
        """Return how far poses are beyond the limits, ``(n,)``: the reachable set with its tolerance, and the doctor's limits without one."""
        beyond = true_beyond_deg(poses, self.side, None) - CONFIG.pose_tolerance_deg
        if self.arm:
            beyond = np.maximum(beyond, true_beyond_deg(poses, self.side, self.arm))
        return beyond


def random_treatment(rng: np.random.Generator, side: Side) -> Treatment:
    """Return a random treatment. The middle of most motions is inside the limits, in half of them beside a limit."""
    arm = random_limits(rng) if rng.random() < 0.8 else None
    treatment = Treatment(side, np.zeros((1, N_AXES)), arm, np.zeros(N_AXES), METHODS[rng.integers(len(METHODS))])
    poses = random_poses(rng, _CANDIDATES)
    beyond = treatment.beyond_deg(poses)
    wanted = beyond < 0.0 if rng.random() < 0.9 else beyond < 20.0
    if rng.random() < 0.5:
        wanted &= beyond > -_BESIDE_DEG
    inside = poses[wanted] if wanted.any() else poses
    middles = inside[rng.integers(len(inside), size=2)]
    path = _between(rng, middles) if rng.random() < 0.4 else _around(rng, middles[0])
    if rng.random() < 0.7:
        path = _up_to_a_limit(rng, treatment, path, middles[0])
    start = motor_angles_deg(path[0], side)
    hanging = motor_angles_deg(np.zeros(N_AXES), side)
    here = start
    if treatment.method != "paper" and rng.random() < 0.8:
        # Usually on the way from the hanging arm, else anywhere, also outside the limits.
        anywhere = motor_angles_deg(random_poses(rng, 1)[0], side)
        here = hanging + rng.random() * (start - hanging) if rng.random() < 0.7 else anywhere
    return treatment._replace(poses=path, here_deg=here)


def _up_to_a_limit(rng: np.random.Generator, treatment: Treatment, path: Floats, middle: Floats) -> Floats:
    """Return the path with less extent around its middle, so that its farthest pose is up to 1 deg inside the limits.

    Only there a setpoint that leads the reference can leave the limits.
    """
    inside_deg = rng.uniform(0.0, 1.0)
    share, step = 0.0, 0.5
    for _ in range(_HALVINGS):
        wider = middle + (share + step) * (path - middle)
        share += step * bool(treatment.beyond_deg(wider).max() < -inside_deg)
        step /= 2
    narrower: Floats = middle + share * (path - middle)
    return narrower


def _around(rng: np.random.Generator, middle: Floats) -> Floats:
    """Return poses ``(n, 5)`` that wander around a pose for 3 to 6 s."""
    times_s = np.arange(0.0, rng.uniform(3.0, 6.0), 0.01)
    turns, begin = rng.uniform(0.1, 0.8, N_AXES), rng.uniform(0.0, 2 * np.pi, N_AXES)
    sizes = rng.uniform(0.0, 1.0) * np.array([6.0, 6.0, 15.0, 15.0, 10.0]) * rng.uniform(0.2, 1.0, N_AXES)
    poses: Floats = middle + sizes * np.sin(np.pi * times_s[:, None] * turns + begin)
    return poses


def _between(rng: np.random.Generator, ends: Floats) -> Floats:
    """Return poses ``(n, 5)`` from one end to the other and back, at up to 60 deg/s."""
    way_deg = max(5.0, float(np.abs(ends[1] - ends[0]).max()))
    half_s = max(1.0, 0.5 * np.pi * way_deg / rng.uniform(20.0, 60.0))
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(0.0, 2 * half_s, 0.01) / half_s)
    poses: Floats = ends[0] + share[:, None] * (ends[1] - ends[0])
    return poses


def perform(folder: Path, rng: np.random.Generator, treatment: Treatment) -> tuple[Floats, str]:
    """Perform a treatment. Return every setpoint that was sent, ``(n, 5)``, and the result."""
    load = treatment.load
    config = structs.replace(CONFIG, side=treatment.side)
    reference = build(load, config)
    beyond = float(treatment.beyond_deg(treatment.poses).max())
    if not isinstance(reference, Reference):
        assert isinstance(reference, Refusal)
        if "its limit is" not in reference.message:
            return np.zeros((0, N_AXES)), "other limit"
        assert beyond > -_FALSE_REFUSAL_DEG, f"refused {-beyond:.2f} deg inside: {reference.message}"
        return np.zeros((0, N_AXES)), "refused"
    assert beyond < _EXACT_DEG, f"accepted {beyond:.2f} deg beyond"
    stepped = Stepped(folder, config)
    stepped.apparatus.angles_deg = treatment.here_deg.tolist()
    stepped.forward(0.1)
    stepped.apparatus.written.clear()
    assert stepped.send(load, reference.trajectory, reference.correction) is None
    if stepped.send(Approach()):
        return np.zeros((0, N_AXES)), "approach refused"
    stepped.until("paused", _WAIT_S)
    assert stepped.send(Play()) is None
    _use(stepped, rng)
    stepped.until("idle", _WAIT_S)
    return np.array(stepped.apparatus.written), "performed"


def _use(stepped: Stepped, rng: np.random.Generator) -> None:
    """Reduce the range, pause, play and return at random, until the arm returns."""
    while stepped.mode in ("playing", "paused"):
        stepped.forward(rng.uniform(0.1, 0.8))
        if stepped.mode == "paused":
            stepped.send(Return() if rng.random() < 0.2 else Play())
        elif stepped.mode == "playing" and (chance := rng.random()) < 0.3:
            stepped.send(ReduceRange() if chance < 0.2 else Pause())


def judge(treatment: Treatment, setpoints: Floats) -> None:
    """Check that no setpoint left the limits. An arm that began outside may only move inwards."""
    beyond = treatment.beyond_deg(pose_deg(setpoints, treatment.side))
    began_outside = max(0.0, float(treatment.beyond_deg(pose_deg(treatment.here_deg[None], treatment.side))[0]))
    level = np.minimum.accumulate(np.maximum(np.concatenate([[began_outside], beyond[:-1]]), 0.0))
    worst = int(np.argmax(beyond - level))
    assert beyond[worst] - level[worst] <= _EXACT_DEG, (
        f"{beyond[worst]:.2f} deg beyond at setpoint {worst} of {len(beyond)}"
    )


def treat_many(folder: Path, seed: int, least: int) -> tuple[int, Counter[str]]:
    """Perform random treatments of both arms until at least so many setpoints were judged. Return their number and the results.

    A setpoint counts if it differs from the one before.
    """
    count, results, number = 0, Counter[str](), 0
    while count < least:
        rng = np.random.default_rng([seed, number])
        treatment = random_treatment(rng, SIDES[number % 2])
        try:
            setpoints, result = perform(folder, rng, treatment)
            if len(setpoints):
                judge(treatment, setpoints)
        except AssertionError as error:
            error.add_note(f"treatment {number} of seed {seed}")
            raise
        count += int(np.sum(np.any(np.diff(setpoints, axis=0) != 0.0, axis=1)))
        results[result] += 1
        number += 1
        if number % _LOGGED == 0:
            log.info("%d setpoints, treatments %s", count, dict(results))
    return count, results


def test_no_setpoint_of_a_random_treatment_leaves_the_limits(tmp_path: Path) -> None:
    count, results = treat_many(tmp_path, seed=5, least=3_000)
    assert count >= 3_000
    assert results["performed"] > 1


@pytest.mark.campaign
@pytest.mark.timeout(0)
def test_a_million_setpoints_of_treatments_stay_inside(tmp_path: Path) -> None:
    # With PoseGate.held doing nothing, treatment 9 of this seed fails; with Run.pose_beyond_deg doing nothing as well, treatment 66.
    count, results = treat_many(tmp_path, seed=14, least=1_000_000)
    log.info("%d setpoints, treatments %s", count, dict(results))
    assert min(results["performed"], results["refused"]) > 100
