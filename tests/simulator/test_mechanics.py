"""Hand, drives and mechanics, stepped without a wire."""

import struct

import numpy as np
import pytest

from kata.motion.builtin import built_in_motions
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.hand import GuidedMotion, HandRefusedError
from kata.simulator.parameters import DRIVES
from kata.simulator.servo_motion import D_NM_S_RAD, I_NM_RAD_S, P_NM_RAD

COUNT_DEG = 360 / 4096
SPEED_DEG_S = 50.0


def rows(motion: Taught) -> GuidedMotion:
    """Return the motion in the hand's form."""
    whole = GuidedMotion()
    whole.add(motion.times_s.tolist(), motion.poses_deg.tolist())
    return whole


class World:
    """An apparatus with its own clock."""

    def __init__(self, seed: int | None = None) -> None:
        self.apparatus = SimulatedApparatus(seed)
        self.servos = ServoBus(self.apparatus).servos
        self.now_ns = self.apparatus.state().t_ns

    def forward(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now_ns += 10_000_000
            self.apparatus.advance(self.now_ns)

    def angles(self) -> np.ndarray:
        return np.array([axis.angle_deg for axis in self.apparatus.state().axes])

    def energise(self) -> None:
        for servo, own in zip(self.servos, DRIVES, strict=True):
            gains = own.d_nm_s_rad / D_NM_S_RAD, own.i_nm_rad_s / I_NM_RAD_S, own.p_nm_rad / P_NM_RAD
            servo.write(80, struct.pack("<HHH", *(round(gain) for gain in gains)))
            servo.write(64, b"\1")

    def send(self, angles_deg: np.ndarray) -> None:
        for servo, angle in zip(self.servos, angles_deg, strict=True):
            servo.write(116, struct.pack("<i", round(2048 + angle / COUNT_DEG)))


def test_hand_traces_a_motion_with_its_foot_on_the_pedal() -> None:
    world = World()
    motion = built_in_motions()[6]
    world.apparatus.guide(motion.name, rows(motion), pedal=True)
    traced: list[np.ndarray] = []
    pedal: list[bool] = []
    while world.apparatus.state().hand.phase != "away":
        world.forward(0.01)
        state = world.apparatus.state()
        if state.hand.phase == "tracing":
            traced.append(world.angles())
            pedal.append(state.pedal_down)

    wanted = motor_angles_deg(motion.poses_deg)
    n = min(len(traced), len(wanted))
    assert np.abs(np.array(traced[:n]) - wanted[:n]).max() < 1.5
    assert all(pedal)
    assert not world.apparatus.state().pedal_down


def test_the_hand_does_not_fight_the_motors() -> None:
    world = World()
    world.energise()
    motion = built_in_motions()[0]
    with pytest.raises(HandRefusedError, match="only while torque is off"):
        world.apparatus.guide("m", rows(motion), pedal=True)


def test_hand_does_one_thing_at_a_time_and_releases_immediately() -> None:
    world = World()
    motion = built_in_motions()[0]
    world.apparatus.guide("m", rows(motion), pedal=True)
    with pytest.raises(HandRefusedError, match="still guiding"):
        world.apparatus.guide("m", rows(motion), pedal=True)
    world.apparatus.let_go()
    assert world.apparatus.state().hand.phase == "away"


def test_a_motion_that_cannot_be_is_refused() -> None:
    world = World()
    motion = GuidedMotion()
    motion.add([0.0, 0.1], [[0.0] * 5] * 2)
    with pytest.raises(HandRefusedError, match="must increase"):
        motion.add([0.1], [[0.0] * 5])
    with pytest.raises(HandRefusedError, match="five angles"):
        motion.add([0.2], [[0.0] * 4])
    with pytest.raises(HandRefusedError, match="cannot"):
        motion.add([0.2], [[80.0, 80.0, 0.0, 0.0, 0.0]])
    with pytest.raises(HandRefusedError, match="at least two rows"):
        world.apparatus.guide("m", GuidedMotion(), pedal=True)
    assert world.apparatus.state().hand.phase == "away"


def test_a_motion_given_in_pieces_is_the_same_motion() -> None:
    whole = built_in_motions()[6]
    times, poses = whole.times_s.tolist(), whole.poses_deg.tolist()
    pieces = GuidedMotion()
    for n in range(0, len(times), 7):
        pieces.add(times[n : n + 7], poses[n : n + 7])
    assert pieces.times_s == rows(whole).times_s
    assert pieces.angles == rows(whole).angles


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
@pytest.mark.parametrize("axis", range(5))
def test_a_drive_follows_a_ramp_closely_and_settles_without_ringing(axis: int, seed: int | None) -> None:
    world = World(seed)
    world.energise()
    start = world.angles()
    goal = start.copy()
    direction = -1.0 if axis == 4 else 1.0
    behind = []
    for _ in range(40):
        goal[axis] += direction * SPEED_DEG_S / 100
        world.send(goal)
        world.forward(0.01)
        behind.append(direction * (goal[axis] - world.angles()[axis]))
    own_lag_s = DRIVES[axis].d_nm_s_rad / DRIVES[axis].p_nm_rad
    assert max(behind) < SPEED_DEG_S * (own_lag_s + 0.02)
    assert behind[-1] == pytest.approx(SPEED_DEG_S * (own_lag_s + 0.01), abs=0.8)
    world.forward(1.0)
    settled = []
    for _ in range(50):
        world.forward(0.01)
        settled.append(world.angles()[axis])
    assert np.abs(np.array(settled) - goal[axis]).max() < 0.3
    assert np.ptp(settled) < 0.2


def test_an_arm_let_go_sinks_and_does_not_fall() -> None:
    world = World()
    world.energise()
    raised = world.angles()
    steps = 200
    for n in range(steps):
        goal = raised.copy()
        goal[3] = 90.0 * (n + 1) / steps
        world.send(goal)
        world.forward(0.01)
    for servo in world.servos:
        servo.write(64, b"\0")
    world.forward(0.3)
    speed = abs(world.apparatus.state().axes[3].speed_deg_s)
    assert 1.0 < speed < 40.0
    assert world.angles()[3] < 90.0


def test_no_torque_without_torque_enable() -> None:
    world = World()
    before = world.angles()
    world.send(before + 30.0)
    world.forward(1.0)
    assert world.angles() == pytest.approx(before, abs=0.5)


def test_goal_current_limits_the_drive() -> None:
    world = World()
    world.energise()
    servo = world.servos[3]
    servo.write(64, b"\0")
    servo.write(11, b"\5")
    servo.write(102, struct.pack("<h", 154))  # 0.414 A: 1 Nm with the 2.41 Nm/A of an XM540-W270
    servo.write(64, b"\1")
    goal = world.angles()
    goal[3] = 90.0
    world.send(goal)
    strongest = 0.0
    for _ in range(100):
        world.forward(0.01)
        strongest = max(strongest, abs(world.apparatus.state().axes[3].torque_nm))
    assert strongest == pytest.approx(1.0, abs=0.01)
