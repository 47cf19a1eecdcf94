"""Limits of setpoints and measured angles: the tighter of mechanism and patient, and the way from the arm's position."""

from collections.abc import Sequence
from itertools import product

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from kata.device.ipc_messages import Approach, Play, ReduceRange, Return, Unload
from kata.device.run_limits import PATH_TOLERANCE_DEG, SETTLE_S, RunLimits
from kata.device.setpoint_gate import largest_step_deg
from kata.motion.linkage import Floats
from kata.motion.method import Method, reference
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import POSE_ROUNDING_DEG, reachable_set
from kata.motion.trajectory import Trajectory
from tests.support.examples import examples
from tests.support.playback import station
from tests.support.stepped import REST_DEG, Stepped
from tests.support.trajectories import LOAD, a_trajectory

MECHANISM = ((-21.0, 45.0), (86.0, 131.0))
"""Of the first two axes: the range and half of the tolerance of 4 deg."""
MOVING = 3
"""The axis that moves from 20 to 40 deg and back in these recordings; the arm rests at 0."""


def limits(low: float, high: float) -> tuple[tuple[float, float], ...]:
    """Return the patient's limits for the moving axis, with wide limits for the others."""
    wide = [(-180.0, 180.0)] * 5
    wide[MOVING] = (low, high)
    return tuple(wide)


def load(stepped: Stepped, low: float, high: float) -> None:
    assert stepped.send(msgspec.structs.replace(LOAD, limits_deg=limits(low, high)), a_trajectory()) is None


def test_without_a_patient_the_limits_are_the_mechanisms(stepped: Stepped) -> None:
    assert stepped.loop._machine.limits_deg[:2] == MECHANISM
    assert stepped.send(LOAD, a_trajectory()) is None
    assert stepped.loop._machine.limits_deg == stepped.config.mechanism_deg


def test_the_tighter_of_mechanism_and_patient_counts_at_each_end(stepped: Stepped) -> None:
    load(stepped, 5.0, 42.0)
    of_run = stepped.loop._machine.limits_deg
    assert of_run[:2] == MECHANISM
    assert of_run[MOVING] == (5.0, 42.0)

    assert stepped.send(Unload()) is None
    assert stepped.loop._machine.limits_deg == stepped.config.mechanism_deg


def test_arm_outside_patient_limits_is_fetched_back_inside(stepped: Stepped) -> None:
    load(stepped, 5.0, 42.0)
    assert stepped.send(Approach()) is None
    assert stepped.loop._machine.limits_deg[MOVING] == (0.0, 42.0)
    stepped.until("paused")
    assert stepped.loop._machine.limits_deg[MOVING] == (5.0, 42.0)
    stepped.send(Play())
    stepped.until("idle")

    assert stepped.causes() == []
    rest_deg = list(REST_DEG)
    rest_deg[MOVING] = 5.0
    assert stepped.apparatus.angles_deg == pytest.approx(rest_deg, abs=0.01)


@pytest.mark.parametrize(("method", "arm_deg", "high_deg"), [("smooth", 60.0, 42.0), ("paper", 26.0, 21.0)])
def test_limits_tighten_behind_the_arm_during_the_approach(
    stepped: Stepped, method: Method, arm_deg: float, high_deg: float
) -> None:
    """The paper's method begins near the recording's start only."""
    stepped.apparatus.angles_deg[MOVING] = arm_deg
    stepped.forward(0.05)
    loaded = msgspec.structs.replace(LOAD, limits_deg=limits(5.0, high_deg), method=method)
    assert stepped.send(loaded, a_trajectory()) is None
    assert stepped.send(Approach()) is None
    assert stepped.loop._machine.limits_deg[MOVING] == (5.0, arm_deg)
    assert stepped.loop._machine.limits_deg[:2] == MECHANISM
    highest, arm = [arm_deg], []
    while stepped.mode == "approaching":
        arm.append(stepped.apparatus.angles_deg[MOVING])
        stepped.cycle()
        highest.append(stepped.loop._machine.limits_deg[MOVING][1])
    assert np.all(np.diff(highest) <= 0.0)
    assert highest[-1] == high_deg
    assert np.max(np.array(highest[1:]) - np.maximum(arm, high_deg)) < 0.5


def test_arm_pushed_out_again_during_the_approach_is_a_fault(stepped: Stepped) -> None:
    """Limits that have tightened do not widen for an arm that leaves them."""
    stepped.apparatus.angles_deg[MOVING] = 60.0
    stepped.forward(0.05)
    load(stepped, 5.0, 42.0)
    assert stepped.send(Approach()) is None
    stepped.forward(1.5)
    reached_deg = stepped.loop._machine.limits_deg[MOVING][1]
    assert 42.0 < reached_deg < 55.0
    stepped.apparatus.drift_deg_s[MOVING] = 50.0
    stepped.until("stopped")
    assert stepped.causes() == ["position_limit"]
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(reached_deg + 2.25, abs=0.5)


@pytest.mark.parametrize(("outside_deg", "waits_s"), [(0.9, 0.0), (1.1, 1.0), (2.1, 1.0)])
def test_approach_ends_with_the_arm_inside_or_after_a_second(
    stepped: Stepped, outside_deg: float, waits_s: float
) -> None:
    """A drive that lags behind its setpoint is outside for a while. Beyond half of the tolerance it is a fault."""
    stepped.apparatus.angles_deg[MOVING] = 18.0 - outside_deg
    stepped.forward(0.05)
    load(stepped, 18.0, 42.0)
    stepped.apparatus.stuck = {MOVING}
    assert stepped.send(Approach()) is None
    movement = stepped.loop._machine._movement
    assert movement is not None
    cycles = 0
    while stepped.mode == "approaching":
        stepped.cycle()
        cycles += movement.ended
    assert cycles / 100 == pytest.approx(waits_s, abs=0.02)
    stepped.forward(0.1)
    assert stepped.causes() == (["position_limit"] if outside_deg > 2.0 else [])


@pytest.mark.counted
def test_the_papers_way_holds_within_the_patients_limits(stepped: Stepped) -> None:
    """This method has no approach to the start, but an arm outside the limits is moved to them."""
    stepped.apparatus.angles_deg[MOVING] = 14.0
    stepped.forward(0.05)
    of_patient = msgspec.structs.replace(LOAD, limits_deg=limits(18.0, 42.0), method="paper")
    motion = a_trajectory()
    times = np.arange(0.0, 2.001, 0.1)
    assert stepped.send(of_patient, reference("paper", times, motion.along(times))) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(18.0, abs=0.01)
    stepped.send(Play())
    stepped.until("idle")
    assert stepped.causes() == []
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(18.0, abs=0.01)


def outside(angles_deg: Floats, low_deg: Floats, high_deg: Floats) -> Floats:
    """Return how far each angle is outside its limits."""
    return np.maximum(np.maximum(low_deg - angles_deg, angles_deg - high_deg), 0.0)


REACHABLE_DEG = ((2.0, 28.0), (98.0, 118.0), (0.0, 120.0), (-20.0, 125.0), (-90.0, 40.0))
"""Ranges of the motors between which every pose is reachable."""


def test_every_pose_between_these_ranges_is_reachable() -> None:
    corners = np.array(list(product(*(np.linspace(low, high, 5) for low, high in REACHABLE_DEG))))
    for bound in reachable_set(corners, "right"):
        assert bound.beyond_deg.max() < 0.0, bound.quantity


shares = st.tuples(*[st.floats(0.0, 1.0)] * 5)
NONE, LAST = (0.0,) * 5, (0.0, 0.0, 0.0, 0.0, 1.0)


# The setpoint that brakes an underdamped drive came back by 5e-7 deg.
@example(LAST, NONE, NONE, NONE, 0.078125, "smooth")
@given(shares, shares, shares, shares, st.floats(0.0, 0.1), st.sampled_from(["smooth", "learned"]))
@examples(few=3, many=50)
def test_no_setpoint_moves_away_from_the_patients_limits(
    tmp_path_factory: pytest.TempPathFactory,
    picked_up: tuple[float, ...],
    lows: tuple[float, ...],
    highs: tuple[float, ...],
    starts: tuple[float, ...],
    lag_s: float,
    method: Method,
) -> None:
    """For any reachable position of the arm, any limits of the motors, and any recording between them."""
    config = station(lag_s=lag_s, lag2_s2=lag_s / 20, friction_deg=lag_s)
    stepped = Stepped(tmp_path_factory.mktemp("run"), config)
    range_low, range_high = np.array(REACHABLE_DEG).T
    a, b = (range_low + np.array(share) * (range_high - range_low) for share in (lows, highs))
    low, high = np.minimum(a, b), np.maximum(a, b)
    stepped.apparatus.angles_deg = (range_low + np.array(picked_up) * (range_high - range_low)).tolist()
    stepped.forward(0.1)
    here = np.array(stepped.apparatus.angles_deg)

    times = np.arange(0.0, 2.005, 0.01)
    swing = np.minimum(8.0, (high - low) / 2) * np.sin(np.pi * times / 2.0)[:, None]
    start = low + np.array(starts) * (high - low)
    trajectory = Trajectory(times, start + np.where(start < (low + high) / 2, swing, -swing))
    # Smoothing deviates from the samples: Load compares the smoothed motion with the limits.
    played = trajectory.along(np.linspace(0.0, 2.0, 4001))
    low, high = np.minimum(low, played.min(0) - 1e-6), np.maximum(high, played.max(0) + 1e-6)
    of_patient = msgspec.structs.replace(
        LOAD, limits_deg=tuple(zip(low.tolist(), high.tolist(), strict=True)), method=method
    )
    assert stepped.send(of_patient, trajectory) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused", 60.0)
    approached = len(stepped.apparatus.written)
    stepped.send(Play())
    stepped.until("idle", 60.0)

    assert stepped.causes() == []
    away = outside(np.array(stepped.apparatus.written), low, high)
    assert np.all(np.diff(away[:approached], axis=0) <= 1e-9)
    assert away[approached:].max() <= 1e-9
    assert stepped.apparatus.angles_deg == pytest.approx(np.clip(here, low, high), abs=0.01)


def test_a_setpoint_beyond_the_patients_limits_is_never_sent(stepped: Stepped) -> None:
    """The service has checked the recording against them; this test is for the case that it has not."""
    load(stepped, 0.0, 35.0)
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    stepped.until("stopped")

    assert stepped.causes() == ["setpoint_limit"]
    assert not stepped.torque
    assert np.array(stepped.apparatus.written)[:, MOVING].max() <= 35.0


def test_an_arm_pushed_beyond_the_patients_limits_is_a_fault(stepped: Stepped) -> None:
    """Half of the tolerance lies between the limit for setpoints and the limit for measured angles."""
    load(stepped, 0.0, 40.5)
    stepped.send(Approach())
    stepped.until("paused")
    stepped.apparatus.drift_deg_s[MOVING] = -50.0
    stepped.until("stopped")

    assert stepped.causes() == ["position_limit"]
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(-2.0 - 0.25, abs=0.26)


@pytest.mark.parametrize(("angle_deg", "refused"), [(-23.0, False), (-23.1, True), (47.0, False), (47.1, True)])
def test_torque_is_refused_when_the_arm_exceeds_range_plus_tolerance(
    stepped: Stepped, angle_deg: float, refused: bool
) -> None:
    stepped.apparatus.angles_deg[0] = angle_deg
    assert stepped.send(LOAD, a_trajectory()) is None
    stepped.forward(0.1)
    refusal = stepped.send(Approach())
    stepped.forward(0.1)

    assert (refusal is not None) == refused
    assert stepped.torque == (not refused)
    assert stepped.causes() == []
    if refusal:
        assert refusal.message == f"Motor 1 is at {angle_deg:.0f}°, outside its range."


# -- the patient's speed limit ----------------------------------------------------------------------------------------


def speeds_deg_s(stepped: Stepped) -> Floats:
    """Return the speed of every axis from setpoint to setpoint."""
    speeds: Floats = np.abs(np.diff(np.array(stepped.apparatus.written), axis=0)) * 100
    return speeds


@pytest.mark.parametrize(("limit_deg_s", "fastest_deg_s"), [(None, 15.0), (20.0, 15.0), (4.0, 4.0)])
def test_approach_and_return_keep_the_patients_speed_limit(
    stepped: Stepped, limit_deg_s: float | None, fastest_deg_s: float
) -> None:
    of_patient = msgspec.structs.replace(LOAD, max_speed_deg_s=limit_deg_s)
    assert stepped.send(of_patient, a_trajectory(20.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused", 60.0)
    assert speeds_deg_s(stepped).max() == pytest.approx(fastest_deg_s, abs=0.1)
    stepped.apparatus.written.clear()
    assert stepped.send(Return()) is None
    stepped.until("idle", 60.0)
    assert speeds_deg_s(stepped).max() == pytest.approx(fastest_deg_s, abs=0.1)


def test_reduced_range_keeps_the_patients_speed_limit(stepped: Stepped) -> None:
    """The path's own highest speed is 3.1 deg/s; reducing the range at the end of the range would add 2.5."""
    of_patient = msgspec.structs.replace(LOAD, max_speed_deg_s=3.2)
    assert stepped.send(of_patient, a_trajectory(20.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused", 60.0)
    assert stepped.send(Play()) is None
    for _ in range(40):
        stepped.forward(0.5)
        stepped.send(ReduceRange())
    stepped.until("idle", 60.0)
    assert stepped.causes() == []
    assert speeds_deg_s(stepped).max() <= 3.2 * 1.01


def test_the_guard_of_setpoints_knows_the_patients_speed_limit(stepped: Stepped) -> None:
    """A step of 1.5 deg takes half a second at 3 deg/s; at the station's own limit it is allowed."""
    of_patient = msgspec.structs.replace(LOAD, max_speed_deg_s=3.0)
    assert stepped.send(of_patient, a_trajectory(20.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused", 60.0)
    assert largest_step_deg(stepped.config.axes[MOVING], 100) > 1.5
    machine = stepped.loop._machine
    assert largest_step_deg(machine.config.axes[MOVING], 100) == pytest.approx(1.0 + 1.5 * 0.03)
    assert machine._movement is not None
    stepped.send(Play())
    machine._movement.position_s = 5.0  # as a defect would
    stepped.cycle()
    assert "setpoint_step" in stepped.causes()


def settling(high_deg: float = 42.0) -> RunLimits:
    """Limits of 5 to 42 deg on every axis, widened for an arm at 60."""
    wide = (0.0, 120.0)
    gate = PoseGate("right", None, 2.0)
    limits = RunLimits((wide,) * 5, (wide, wide, *((5.0, high_deg),) * 3), tolerance_deg=4.0, gate=gate)
    limits.widen(arm(60.0))
    return limits


def arm(angle_deg: float) -> tuple[float, ...]:
    """The scapula at rest, and the other motors at one angle."""
    return (*REST_DEG[:2], *(angle_deg,) * 3)


def test_arm_that_stays_outside_has_exactly_its_settling_time() -> None:
    limits = settling()
    inside, outside = arm(40.0), arm(50.0)
    assert [limits.settle(inside, outside, SETTLE_S / 4) for _ in range(4)] == [False, False, False, True]
    assert not limits.widened


def test_limits_do_not_tighten_before_a_setpoint_still_outside() -> None:
    limits = settling()
    inside, just_outside = arm(40.0), arm(42.5)
    assert not limits.settle(just_outside, inside, 2 * SETTLE_S)
    assert limits.widened
    assert limits.settle(inside, inside, 0.0)


@pytest.mark.parametrize(
    ("arm_deg", "settles"),
    [(42.9, True), (43.0, True), (43.1, False), (4.1, True), (4.0, True), (3.9, False), (42.0, True), (5.0, True)],
)
def test_arm_within_a_quarter_of_the_tolerance_is_inside(arm_deg: float, settles: bool) -> None:
    assert settling().settle(arm(40.0), arm(arm_deg), 0.0) is settles


# -- limits of the pose -----------------------------------------------------------------------------------------------


class Slope(PoseGate):
    """A gate whose pose is beyond the limits by as much as the moving axis exceeds 40 deg. It records the poses that it was asked for."""

    def __init__(self) -> None:
        super().__init__("right", None, 0.0)
        self.asked: list[Sequence[float]] = []

    def beyond_deg(self, motors_deg: Sequence[float]) -> float:
        self.asked.append(motors_deg)
        return motors_deg[MOVING] - 40.0


def pose(angle_deg: float) -> Floats:
    here_deg = np.array(REST_DEG)
    here_deg[MOVING] = angle_deg
    return here_deg


def sloped() -> tuple[RunLimits, Slope]:
    gate = Slope()
    return RunLimits(((-180.0, 180.0),) * 5, (), 4.0, gate), gate


@pytest.mark.parametrize(("angle_deg", "beyond_deg"), [(40.8, 0.8), (38.0, 0.0)])
def test_pose_limits_are_widened_as_the_arm_needs(angle_deg: float, beyond_deg: float) -> None:
    of_pose, _ = sloped()
    assert of_pose.beyond_deg == 0.0
    of_pose.widen(pose(angle_deg).tolist())
    assert of_pose.beyond_deg == pytest.approx(beyond_deg)


def test_widened_pose_limits_only_move_inwards() -> None:
    of_pose, gate = sloped()
    of_pose.widen(pose(40.8).tolist())
    levels = []
    for setpoint_deg, measured_deg in [(40.3, 40.5), (40.7, 40.2), (40.2, 40.1), (39.0, 39.5)]:
        of_pose.tighten(pose(setpoint_deg).tolist(), pose(measured_deg).tolist())
        levels.append(of_pose.beyond_deg)
    assert levels == pytest.approx([0.5, 0.5, 0.2, 0.0])
    gate.asked.clear()
    of_pose.tighten(pose(39.0).tolist(), pose(39.0).tolist())
    assert gate.asked == []  # Tight limits need no calculation in the cycle.


def test_path_that_leads_only_inwards_exceeds_nothing() -> None:
    of_pose, gate = sloped()
    assert of_pose.path_excess_deg(pose(45.0), pose(30.0)) == 0.0
    # Every degree is looked at.
    assert np.diff([asked[MOVING] for asked in gate.asked]) == pytest.approx(np.full(15, -1.0))
    assert of_pose.path_excess_deg(pose(45.0), pose(38.0), pose(43.0)) == pytest.approx(3.0)


@pytest.mark.parametrize("length_deg", [0.0, 0.5, 1.0])
def test_short_path_is_looked_at_where_it_begins_and_ends(length_deg: float) -> None:
    of_pose, gate = sloped()
    of_pose.path_excess_deg(pose(30.0), pose(30.0 + length_deg))
    assert [asked[MOVING] for asked in gate.asked] == [30.0, 30.0 + length_deg]


@pytest.mark.parametrize(("share", "settles"), [(1.0, True), (1.001, False)])
def test_a_pose_may_exceed_the_limits_by_rounding(monkeypatch: pytest.MonkeyPatch, share: float, settles: bool) -> None:
    of_pose, gate = sloped()
    monkeypatch.setattr(gate, "beyond_deg", lambda motors_deg: share * POSE_ROUNDING_DEG)
    assert of_pose.settle(REST_DEG, REST_DEG, SETTLE_S) is settles


def test_setpoint_leads_no_farther_outwards_during_an_approach(stepped: Stepped) -> None:
    """What would take it outwards here, a yield of 20 deg, is clipped to the limits that move inwards with the arm."""
    stepped.apparatus.angles_deg[MOVING] = 60.0
    stepped.forward(0.1)
    load(stepped, 5.0, 42.0)
    assert stepped.send(Approach()) is None
    stepped.forward(1.0)
    run = stepped.loop._machine._run
    assert run is not None and run.limits.widened
    highest_deg, count = run.limits_deg[MOVING][1], len(stepped.apparatus.written)
    assert 50.0 < highest_deg < 59.0
    run._yield_offset.offset_deg[MOVING] = 20.0
    stepped.forward(0.3)
    assert stepped.causes() == []
    setpoints = np.array(stepped.apparatus.written)[count:, MOVING]
    assert highest_deg - 0.1 < setpoints.max() <= highest_deg


def test_setpoint_is_held_inside_once_the_approach_has_settled(stepped: Stepped) -> None:
    """The arm itself may still be outside: a soft patient holds it there."""
    load(stepped, 5.0, 42.0)
    run = stepped.loop._machine._run
    assert run is not None
    run.begin(pose(50.0))
    run.tighten(pose(42.0).tolist(), pose(50.0).tolist())
    assert run.settle(pose(42.0).tolist(), pose(50.0).tolist(), SETTLE_S)
    movement = run.movement_along(run.trajectory, direction=1)
    movement.position_s = 1.0
    run.start_path(pose(40.0))
    setpoints = []
    for _ in range(50):
        run._yield_offset.offset_deg[MOVING] = 20.0
        setpoints.append(run.setpoint(movement)[MOVING])
    assert max(setpoints) == 42.0


def test_setpoint_turns_at_a_limit_without_delay(stepped: Stepped) -> None:
    """The feed-forward ends at the limit, too. It would need two more setpoints to come back from beyond it."""
    load(stepped, 16.0, 42.0)
    run = stepped.loop._machine._run
    assert run is not None
    run.start_path(run.trajectory.start_deg)
    movement = run.movement_along(run.trajectory, direction=0)
    setpoints = []
    for change_deg in [-0.5] * 8 + [0.2] * 2:
        run._yield_offset.retreat(change_deg * (np.arange(5) == MOVING))
        setpoints.append(run.setpoint(movement)[MOVING])
    assert setpoints[-2] == 16.0
    assert setpoints[-1] > 16.2


@given(st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(0.0, 1.0)), min_size=20, max_size=120))
@example([(2.0, 0.1)] * 20)
@examples(few=20, many=1000)
def test_limits_that_follow_an_arm_jerk_no_setpoint(
    tmp_path_factory: pytest.TempPathFactory, changes_deg: list[tuple[float, float]]
) -> None:
    """The setpoint leads an arm that is fetched from outside, and comes back towards it. Each step: change of the setpoint, and way of the arm inwards."""
    stepped = Stepped(tmp_path_factory.mktemp("run"))
    load(stepped, 5.0, 21.0)
    run = stepped.loop._machine._run
    assert run is not None
    arm_deg = 28.0
    run.begin(pose(arm_deg))
    run.start_path(run.trajectory.start_deg)
    movement = run.movement_along(run.trajectory, direction=0)
    setpoints = [float(run.trajectory.start_deg[MOVING])] * 2
    for change_deg, inwards_deg in changes_deg:
        run._yield_offset.retreat(change_deg * (np.arange(5) == MOVING))
        setpoint_deg = run.setpoint(movement)
        setpoints.append(setpoint_deg[MOVING])
        assert setpoint_deg[MOVING] <= run.limits_deg[MOVING][1] + 1e-9
        arm_deg = max(arm_deg - inwards_deg, 21.0)
        run.tighten(setpoint_deg, pose(arm_deg).tolist())
    limit_deg = run.config.axes[MOVING].max_acceleration_deg_s2 / run.rate_hz**2
    assert np.abs(np.diff(setpoints, 2)).max() <= limit_deg + 1e-9


@pytest.mark.parametrize(("beyond_deg", "return_deg"), [(PATH_TOLERANCE_DEG, 42.0), (1.001 * PATH_TOLERANCE_DEG, 40.0)])
def test_return_leaves_the_nearest_pose_beyond_the_tolerance(
    stepped: Stepped, monkeypatch: pytest.MonkeyPatch, beyond_deg: float, return_deg: float
) -> None:
    monkeypatch.setattr(RunLimits, "path_excess_deg", lambda limits, *corners_deg: beyond_deg)
    load(stepped, 5.0, 42.0)
    run = stepped.loop._machine._run
    assert run is not None
    monkeypatch.setattr(run.limits, "entry_deg", lambda here_deg, start_deg: np.full(5, 40.0))
    run.begin(pose(60.0))
    assert run.return_to_deg is not None and run.return_to_deg[MOVING] == return_deg


def test_return_ends_at_the_first_pose_inside_the_limits() -> None:
    of_pose, _ = sloped()
    assert of_pose.entry_deg(pose(50.0), pose(20.0))[MOVING] == pytest.approx(40.0)
