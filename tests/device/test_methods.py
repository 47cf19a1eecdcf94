"""A run with each method: the feed-forward, the correction, and the paper's zero-order hold."""

from pathlib import Path
from typing import Literal, get_args

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device import journal
from kata.device.config import REFERENCE_SHARE, StationConfig, simulated
from kata.device.faults import FAULTS
from kata.device.ipc_messages import Approach, Command, Pause, Play, ReduceRange, Refusal, Return
from kata.device.journal import JournalDisk, JournalWriter
from kata.device.references import build
from kata.device.run import Run
from kata.motion.ilc import Correction
from kata.motion.linkage import Floats
from kata.motion.method import FeedForward, Method, reference
from kata.motion.trajectory import Trajectory, ZeroOrderHold
from tests.support.examples import examples
from tests.support.journals import HEADER
from tests.support.playback import METHODS, MOVING, load, place_s, sent, station, until_place
from tests.support.simulated_loop import SimulatedLoop, load_of
from tests.support.stepped import REST_DEG, Stepped

SECONDS = 4.0
TIMES_S = np.arange(0.0, SECONDS + 0.001, 0.01)


def rows(reach_deg: float = 30.0, from_deg: float = 0.0) -> Floats:
    angles = np.tile(np.array(REST_DEG), (len(TIMES_S), 1))
    angles[:, MOVING] = from_deg + reach_deg * (1 - np.cos(2 * np.pi * TIMES_S / SECONDS))
    return angles


def begin(
    folder: Path,
    config: StationConfig,
    method: Method,
    angles: Floats | None = None,
    correction: Correction | None = None,
    **changes: object,
) -> tuple[Stepped, Trajectory]:
    """Return a run whose approach has ended."""
    stepped = Stepped(folder, config)
    trajectory = reference(method, TIMES_S, rows() if angles is None else angles)
    assert stepped.send(load(method, **changes), trajectory, correction) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    return stepped, trajectory


# -- ahead of the drives ----------------------------------------------------------------------------------------------


def test_setpoints_lead_the_reference_by_the_drive_lag(tmp_path: Path) -> None:
    config = station(lag_s=0.08, lag2_s2=0.003, friction_deg=0.4)
    stepped, trajectory = begin(tmp_path, config, "smooth")
    stepped.send(Play())
    for at_s in (0.5, 1.0, 1.5, 2.5, 3.2):
        until_place(stepped, at_s)
        # The setpoint aims at the middle of its own period; the place has advanced by one cycle since.
        motion = trajectory.motion_at(place_s(stepped) - 0.01 + 0.005)
        assert sent(stepped)[-1] == pytest.approx(
            (motion.angles_deg + config.servo_model.feed_forward(motion))[MOVING], abs=1e-6
        )
        assert abs(config.servo_model.feed_forward(motion)[MOVING]) > 0.5
    stepped.until("idle")
    assert stepped.causes() == []


def test_lead_shrinks_as_the_drives_integral_removes_the_lag(tmp_path: Path) -> None:
    config = station(lag_s=0.1)
    axes = tuple(msgspec.structs.replace(axis, integral_s=0.3) for axis in config.axes)
    config = msgspec.structs.replace(config, axes=axes)
    stepped, trajectory = begin(tmp_path, config, "smooth")
    stepped.forward(3.0)
    lead = FeedForward(config.servo_model, 1.0 / config.rate_hz)
    stepped.send(Play())
    while place_s(stepped) < 3.0:
        before_s = place_s(stepped)
        stepped.cycle()
        # The setpoint aims at the middle of its own period.
        motion = trajectory.motion_at(place_s(stepped) - (place_s(stepped) - before_s) / 2)
        wanted_deg = (motion.angles_deg + lead.at(motion))[MOVING]
        if before_s > 0.3:
            assert sent(stepped)[-1] == pytest.approx(wanted_deg, abs=0.05)
    assert stepped.causes() == []


def fast_rotation(stop_s: float) -> tuple[Floats, Floats]:
    """Return times and angles of a motion of one motor that reaches 60 deg/s in 0.3 s, and rest again within ``stop_s``."""
    times = np.arange(0.0, 2.0, 0.01)
    starts, stops = np.clip((times - 0.5) / 0.3, 0.0, 1.0), np.clip((1.1 + stop_s - times) / stop_s, 0.0, 1.0)
    speed_deg_s = 15.0 * (1 - np.cos(np.pi * starts)) * (1 - np.cos(np.pi * stops))
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, MOVING] += np.cumsum(speed_deg_s) * 0.01
    return times, angles


@pytest.mark.parametrize("rate_hz", [50, 100, 200])
def test_lead_is_complete_while_a_fast_motion_starts_and_stops(tmp_path: Path, rate_hz: int) -> None:
    """At the limits of every station by default. An incomplete lead is an overshoot of the arm: a lag of 0.14 s changes by 8 deg in 0.2 s."""
    axes = tuple(msgspec.structs.replace(axis, lag_s=0.14) for axis in StationConfig().axes)
    config = StationConfig(axes=axes, rate_hz=rate_hz, cycle_hz=rate_hz)
    stepped = Stepped(tmp_path, config)
    trajectory = reference("smooth", *fast_rotation(0.2))
    assert stepped.send(load("smooth"), trajectory) is None
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    until_place(stepped, 0.4)
    missing_deg = []
    while place_s(stepped) < 1.8:
        stepped.cycle()
        motion = trajectory.motion_at(place_s(stepped) - 0.5 / rate_hz + config.setpoint_delay_s)
        wanted_deg = (motion.angles_deg + config.servo_model.feed_forward(motion))[MOVING]
        missing_deg.append(abs(sent(stepped)[-1] - wanted_deg))
    assert max(missing_deg) < 0.1
    assert stepped.causes() == []


@pytest.mark.parametrize("method", ["smooth", "learned"])
def test_journal_contains_the_setpoints_that_were_sent(tmp_path: Path, method: Method) -> None:
    """The drives in this test follow at once, so they are as far ahead as the setpoint."""
    stepped, trajectory = begin(tmp_path, station(lag_s=0.08), method)
    stepped.send(Play())
    stepped.until("idle")
    recorded = stepped.journal()
    playing = recorded.phase == journal.PHASE_PLAYING
    assert recorded.setpoint_deg[playing][5:] == pytest.approx(recorded.measured_deg[playing][5:], abs=1e-4)
    feed_forward = recorded.setpoint_deg[playing][:, MOVING] - trajectory.along(recorded.path_s[playing])[:, MOVING]
    assert np.abs(feed_forward).max() == pytest.approx(0.08 * 30 * np.pi / 2, abs=0.3)


def test_lead_vanishes_at_rest_and_resuming_has_no_jump(tmp_path: Path) -> None:
    config = station(lag_s=0.1, lag2_s2=0.004, friction_deg=0.5)
    stepped, trajectory = begin(tmp_path, config, "smooth")
    stepped.forward(0.1)
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(0.0)[MOVING], abs=1e-6)
    stepped.send(Play())
    until_place(stepped, 1.0)
    stepped.send(Pause())
    stepped.until("paused")
    stepped.forward(0.3)
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(place_s(stepped))[MOVING], abs=1e-6)
    stepped.send(Play())
    stepped.until("idle")
    assert stepped.causes() == []
    # 47 deg/s is the recording's own highest speed; the feed-forward changes by at most its share of the second
    # difference.
    second_difference = config.axes[MOVING].max_acceleration_deg_s2 / 100**2
    assert np.abs(np.diff(sent(stepped))).max() < 0.47 + REFERENCE_SHARE * second_difference
    assert np.abs(np.diff(sent(stepped), 2)).max() < 0.9 * second_difference
    assert stepped.apparatus.angles_deg == pytest.approx(REST_DEG, abs=0.01)


def test_speed_override_counts_in_feed_forward(tmp_path: Path) -> None:
    """On the ramp the arm is slower than the recording and lags less."""
    config = station(lag_s=0.1)
    stepped, trajectory = begin(tmp_path, config, "smooth")
    stepped.send(Play())
    until_place(stepped, 1.0)
    stepped.send(Pause())
    stepped.forward(0.1)
    movement = stepped.loop._machine._movement
    assert movement is not None
    assert 0.3 < movement.speed_override < 0.6
    pace_then = movement.speed_override + 0.05
    place = place_s(stepped) - movement.speed_override * 0.01 + pace_then * 0.005
    feed_forward = sent(stepped)[-1] - trajectory.at(place)[MOVING]
    assert feed_forward == pytest.approx(0.1 * pace_then * trajectory.motion_at(place).speed_deg_s[MOVING], abs=0.1)


def test_nothing_is_sent_beyond_a_limit_for_being_ahead(tmp_path: Path) -> None:
    limits = [(-180.0, 180.0)] * 5
    limits[MOVING] = (-1.0, 60.1)
    config = station(lag_s=0.1, friction_deg=2.0)
    angles = rows()
    # At full speed up to the reversal.
    angles[:, MOVING] = np.interp(TIMES_S, [0.0, 0.3, 1.7, 1.9, 2.1, 2.3, 4.0], [0.0, 0.0, 59.0, 60.0, 60.0, 59.0, 0.0])
    stepped, _ = begin(tmp_path, config, "smooth", angles, limits_deg=tuple(limits))
    stepped.send(Play())
    stepped.until("idle")
    assert stepped.causes() == []
    assert sent(stepped).max() == 60.1
    assert sent(stepped).min() == -1.0


# In every run each rate once, and both directions.
@pytest.mark.parametrize(
    ("rate_hz", "direction"),
    [
        pytest.param(rate_hz, direction, marks=() if direction == first else pytest.mark.campaign)
        for rate_hz, first in ((50, 1), (100, -1), (200, 1))
        for direction in (1, -1)
    ],
)
def test_a_fast_setpoint_brakes_before_a_limit(tmp_path: Path, rate_hz: int, direction: int) -> None:
    """With the default limits of speed and acceleration, a reference that reverses just inside the patient's limit."""
    limits = [(-180.0, 180.0)] * 5
    limits[MOVING] = (-10.1, 50.1)
    axes = tuple(msgspec.structs.replace(axis, lag_s=0.1, friction_deg=2.0) for axis in StationConfig().axes)
    config = StationConfig(axes=axes, rate_hz=rate_hz, cycle_hz=rate_hz)
    angles = rows()
    swing = np.interp(TIMES_S, [0.0, 0.3, 1.7, 1.9, 2.1, 2.3, 4.0], [0.0, 0.0, 29.5, 30.0, 30.0, 29.5, 0.0])
    angles[:, MOVING] = 20.0 + direction * swing
    stepped, _ = begin(tmp_path, config, "smooth", angles, limits_deg=tuple(limits))
    stepped.apparatus.written.clear()
    stepped.send(Play())
    stepped.until("returning")
    assert stepped.causes() == []
    furthest = sent(stepped).max() if direction > 0 else 40.0 - sent(stepped).min()
    assert 49.9 < furthest <= 50.1
    second_difference = config.axes[MOVING].max_acceleration_deg_s2 / rate_hz**2
    assert np.abs(np.diff(sent(stepped), 2)).max() < 0.98 * second_difference


@pytest.mark.parametrize("rate_hz", [50, 100])
def test_reversing_a_fast_arm_does_not_drop_it_for_jerk(tmp_path: Path, rate_hz: int) -> None:
    """The slowest drives that may be configured, the highest speed, the fastest reversal."""
    config = station(lag_s=0.3, lag2_s2=0.02, friction_deg=5.0, rate_hz=rate_hz)
    stepped, _ = begin(tmp_path, config, "smooth", rows(reach_deg=85.0), resistance_level=10)
    stepped.send(Play())
    until_place(stepped, 1.0)
    stepped.apparatus.torques_nm[MOVING] = 2.0
    stepped.forward(0.2)
    stepped.apparatus.torques_nm[MOVING] = 0.0
    stepped.until("paused")
    assert stepped.causes() == []
    stepped.send(Play())
    stepped.forward(0.3)
    stepped.link.request_stop()
    stepped.forward(0.5)
    assert stepped.causes() == ["operator_stop"]


def test_the_last_look_still_refuses_a_reference_that_jerks(tmp_path: Path) -> None:
    """Only the feed-forward is limited."""
    angles = rows()
    angles[TIMES_S >= 1.0, MOVING] += 12.0
    stepped, _ = begin(tmp_path, station(lag_s=0.1), "smooth", angles)
    stepped.send(Play())
    stepped.until("stopped")
    assert "setpoint_acceleration" in stepped.causes() or "setpoint_step" in stepped.causes()


def test_feed_forward_gets_the_acceleration_that_the_reference_leaves(tmp_path: Path) -> None:
    """Of 0.6 deg for each setpoint they use at most 98 % together. The feed-forward has at least 13 %, also beside a jerk, and at most 63 %."""
    angles = rows()
    angles[TIMES_S >= 1.0, MOVING] += 12.0
    trajectory = reference("smooth", TIMES_S, angles)
    run = Run(load("smooth"), trajectory, JournalWriter(tmp_path, HEADER, JournalDisk()), station(lag_s=0.1))
    run.start_path(trajectory.start_deg)
    movement = run.movement_along(trajectory, direction=1)
    places_deg, leads_deg = [], []
    while movement.position_s < 1.3:
        run.setpoint(movement)
        movement.advance(0.01)
        places_deg.append(run.reference_deg[MOVING])
        leads_deg.append(run._limited_feed_forward.deg[MOVING])
    of_reference, of_lead = np.abs(np.diff(places_deg, 2)), np.abs(np.diff(leads_deg, 2))
    assert of_reference.max() > 4.0
    left = np.clip(0.98 * 0.6 - of_reference, 0.13 * 0.6, 0.63 * 0.6)
    assert (of_lead <= left + 1e-9).all()
    behind = of_reference > 0.1
    assert of_lead[behind] == pytest.approx(left[behind], abs=1e-6)


@pytest.mark.parametrize(("rate_hz", "creep"), [(100, 0.1), (200, 0.35 * 6_000.0 / 150.0 / 200)])
def test_creep_stops_within_one_setpoint(tmp_path: Path, rate_hz: int, creep: float) -> None:
    """A reference may use 35 % of the acceleration limit for its ramps."""
    config = station(rate_hz=rate_hz, cycle_hz=rate_hz)
    writer = JournalWriter(tmp_path, HEADER, JournalDisk())
    run = Run(load("smooth"), reference("smooth", TIMES_S, rows()), writer, config)
    assert run.movement_along(run.trajectory, direction=1).creep == pytest.approx(creep)


def test_approach_and_return_use_feed_forward_and_end_exactly(tmp_path: Path) -> None:
    config = station(lag_s=0.1)
    stepped, trajectory = begin(tmp_path, config, "smooth", rows(from_deg=20.0))
    steps = np.diff(sent(stepped))
    assert sent(stepped)[0] == 0.0
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(0.0)[MOVING], abs=1e-6)
    middle = len(steps) // 2
    assert sent(stepped)[middle] > 10.5
    stepped.send(Play())
    until_place(stepped, 1.0)
    stepped.send(Pause())
    stepped.until("paused")
    stepped.send(Return())
    stepped.until("idle")
    assert np.abs(np.diff(sent(stepped))).max() < 0.85
    assert stepped.apparatus.angles_deg == pytest.approx(REST_DEG, abs=0.01)


def test_recording_cut_at_full_speed_joins_the_return_without_jumps(tmp_path: Path) -> None:
    """The setpoint is still ahead there: the return begins at the setpoint, without adding the feed-forward again."""
    angles = np.tile(np.array(REST_DEG), (len(TIMES_S), 1))
    angles[:, MOVING] = 100.0 * np.clip(TIMES_S - 3.0, 0.0, None)
    stepped, _ = begin(tmp_path, station(lag_s=0.3, friction_deg=3.0), "smooth", angles)
    stepped.send(Play())
    stepped.until("returning")
    came = len(sent(stepped))
    ahead_deg = sent(stepped)[-1] - 100.0
    assert ahead_deg > 3.0
    stepped.until("idle")
    assert stepped.causes() == []
    assert np.abs(np.diff(sent(stepped)[came - 1 :])).max() <= 0.151  # 15 deg/s
    assert stepped.apparatus.angles_deg == pytest.approx(REST_DEG, abs=0.01)


def test_resistance_is_judged_against_the_arms_direction_not_the_setpoints(tmp_path: Path) -> None:
    """Before the arm reverses, the setpoint already moves back."""
    stepped, trajectory = begin(tmp_path, station(lag_s=0.3), "smooth", resistance_level=10)
    stepped.send(Play())
    until_place(stepped, 1.75)
    assert np.diff(sent(stepped))[-1] < 0.0
    assert trajectory.motion_at(place_s(stepped)).speed_deg_s[MOVING] > 5.0
    stepped.apparatus.torques_nm[MOVING] = 2.0
    stepped.forward(0.13)
    run = stepped.loop._machine._run
    assert run is not None
    assert run.resisting_axis == MOVING


# -- learned corrections -------------------------------------------------------------------------------------------------


def learned(deg: float) -> Correction:
    """Return a constant correction."""
    return Correction(0.02, np.full((201, 5), deg))


def test_learned_correction_applies_at_full_speed_and_not_at_rest(tmp_path: Path) -> None:
    stepped, trajectory = begin(tmp_path, station(), "learned", correction=learned(1.5))
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(0.0)[MOVING], abs=1e-6)
    stepped.send(Play())
    until_place(stepped, 1.0)
    reference_deg = trajectory.at(place_s(stepped) - 0.005)[MOVING]
    assert sent(stepped)[-1] - reference_deg == pytest.approx(1.5, abs=1e-6)
    stepped.send(Pause())
    stepped.until("paused")
    stepped.forward(0.1)
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(place_s(stepped))[MOVING], abs=1e-6)
    stepped.send(Return())
    stepped.until("idle")
    assert stepped.causes() == []
    assert np.abs(np.diff(sent(stepped))).max() < 0.8


@pytest.mark.counted
def test_learned_correction_is_read_at_the_setpoints_place(tmp_path: Path) -> None:
    sloping = Correction(0.02, np.tile(np.linspace(0.0, 2.0, 201)[:, None], 5))
    stepped, trajectory = begin(tmp_path, station(), "learned", correction=sloping)
    stepped.send(Play())
    until_place(stepped, 2.0)
    place = place_s(stepped) - 0.005
    assert sent(stepped)[-1] - trajectory.at(place)[MOVING] == pytest.approx(place * 2.0 / 4.0, abs=1e-6)


def test_learned_correction_of_forward_motion_is_not_added_on_return(tmp_path: Path) -> None:
    stepped, trajectory = begin(tmp_path, station(), "learned", correction=learned(1.5), resistance_level=10)
    stepped.send(Play())
    until_place(stepped, 1.5)
    stepped.apparatus.torques_nm[MOVING] = 2.0
    stepped.forward(0.15)
    stepped.apparatus.torques_nm[MOVING] = 0.0
    stepped.forward(0.3)
    movement = stepped.loop._machine._movement
    assert movement is not None
    assert movement.speed_override == -1.0
    assert sent(stepped)[-1] == pytest.approx(trajectory.at(place_s(stepped) + 0.01 - 0.005)[MOVING], abs=1e-6)


def test_a_correction_that_jumps_is_followed_in_small_steps(tmp_path: Path) -> None:
    """Its share of the highest acceleration: a step differs by at most 0.378 deg from the one before, at 100 Hz."""
    jumping = Correction(0.02, np.tile(np.where(np.arange(201) % 40 < 20, 3.0, -3.0)[:, None], 5))
    stepped, trajectory = begin(tmp_path, station(), "learned", rows(reach_deg=0.0), correction=jumping)
    stepped.send(Play())
    stepped.until("returning")
    assert stepped.causes() == []
    # The correction jumps within 20 ms. The setpoint accelerates with it for three steps at most, and closes the rest at 0.288 deg a step.
    steps = np.abs(np.diff(sent(stepped)))
    assert steps.max() <= 3 * 0.378
    assert np.median(steps[steps > 1e-6]) == pytest.approx(0.288)
    assert np.abs(np.diff(sent(stepped), 2)).max() == pytest.approx(0.378)
    assert np.abs(sent(stepped) - trajectory.at(0.0)[MOVING]).max() == pytest.approx(3.0, abs=0.2)


# -- as in the paper --------------------------------------------------------------------------------------------------


@pytest.fixture
def paper(tmp_path: Path) -> Stepped:
    """Return a run that holds the arm 5 deg away from the recording's start."""
    return begin(tmp_path, station(lag_s=0.1, friction_deg=1.0), "paper", rows(from_deg=5.0))[0]


def test_paper_method_steps_to_the_first_sample_without_an_approach(paper: Stepped) -> None:
    assert paper.torque
    assert set(sent(paper)) == {0.0}
    run = paper.snapshot.run
    assert run is not None
    assert (run.at_start, run.left_s) == (True, 4.0)
    paper.forward(1.0)
    assert set(sent(paper)) == {0.0}

    paper.send(Play())
    paper.cycle()
    assert sent(paper)[-1] == 5.0
    assert paper.causes() == []


@pytest.mark.parametrize("cycles_before", [0, 3, 7])
def test_paper_method_sends_only_one_sample_per_100_ms(paper: Stepped, cycles_before: int) -> None:
    """The same samples at any start time: no lead, no feed-forward, nothing between samples."""
    for _ in range(cycles_before):
        paper.cycle()
    before = len(sent(paper))
    paper.send(Play())
    paper.until("returning")
    recorded = paper.journal()
    playing = recorded.phase == journal.PHASE_PLAYING
    trajectory = reference("paper", TIMES_S, rows(from_deg=5.0))
    assert isinstance(trajectory, ZeroOrderHold)
    setpoints = sent(paper)[before:]
    assert setpoints[:39] == pytest.approx(trajectory.samples[:39, MOVING])
    assert recorded.rate_hz == 10
    path_s = recorded.path_s[playing]
    assert path_s[1:39] == pytest.approx(0.1 * np.arange(1, 39))
    assert np.diff(recorded.t_ns[playing])[:38] == pytest.approx([100_000_000] * 38)
    # The angle measured with a sample is the result of the sample before: 0.1 s late.
    assert recorded.setpoint_deg[playing][1:39, MOVING] == pytest.approx(trajectory.samples[:38, MOVING], abs=1e-4)
    paper.until("idle")
    assert paper.causes() == []


def test_ten_hertz_station_plays_the_paper_method_at_its_rate(tmp_path: Path) -> None:
    stepped, _ = begin(tmp_path, station(rate_hz=10), "paper")
    stepped.send(Play())
    stepped.until("idle")
    assert stepped.journal().rate_hz == 10
    assert stepped.causes() == []


def test_pause_in_the_paper_method_holds_and_resumes(paper: Stepped) -> None:
    paper.send(Play())
    until_place(paper, 1.0)
    paper.send(Pause())
    paper.until("paused")
    held = sent(paper)[-1]
    place = place_s(paper)
    assert place == pytest.approx(1.1, abs=0.02)
    paper.forward(2.0)
    assert sent(paper)[-1] == held
    assert paper.causes() == []
    paper.send(Play())
    paper.forward(0.1)
    assert place_s(paper) == pytest.approx(place + 0.1, abs=0.011)
    paper.until("idle")
    end = paper.journal().end
    assert end is not None
    assert end.reason == "completed"
    assert np.abs(np.diff(sent(paper))).max() < 5.1


@pytest.mark.parametrize("before_playing", [True, False])
def test_the_way_back_in_the_papers_way_is_gentle(paper: Stepped, before_playing: bool) -> None:
    if not before_playing:
        paper.send(Play())
        until_place(paper, 2.0)
        paper.send(Pause())
        paper.until("paused")
    already = len(sent(paper))
    assert paper.send(Return()) is None
    paper.until("idle")
    assert np.abs(np.diff(sent(paper)[already:])).max() <= 1.501  # 15 deg/s
    assert paper.apparatus.angles_deg == pytest.approx(REST_DEG, abs=0.2)


def test_stop_in_the_paper_method_ramps_down_before_torque_off(paper: Stepped) -> None:
    paper.send(Play())
    until_place(paper, 1.0)
    paper.link.request_stop()
    paper.forward(0.15)
    assert paper.torque
    paper.forward(0.1)
    assert not paper.torque
    assert paper.causes() == ["operator_stop"]


def test_resistance_in_the_papers_way_takes_the_arm_back(tmp_path: Path) -> None:
    stepped, _ = begin(tmp_path, station(), "paper", resistance_level=10)
    stepped.send(Play())
    until_place(stepped, 1.5)
    stepped.apparatus.torques_nm[MOVING] = 2.0
    stepped.forward(0.25)
    stepped.apparatus.torques_nm[MOVING] = 0.0
    furthest = sent(stepped)[-1]
    stepped.until("paused")
    assert sent(stepped)[-1] < furthest - 20.0
    assert stepped.causes() == []
    stepped.send(Play())
    stepped.until("idle")


@pytest.mark.counted
@pytest.mark.parametrize(("away_deg", "refused"), [(8.0, False), (-8.0, False), (8.1, True), (-8.1, True)])
def test_paper_start_too_far_away_is_refused_before_torque(tmp_path: Path, away_deg: float, refused: bool) -> None:
    stepped = Stepped(tmp_path, station())
    stepped.apparatus.angles_deg[MOVING] = 30.0 + away_deg
    stepped.forward(0.1)
    angles = rows(from_deg=30.0, reach_deg=20.0)
    assert stepped.send(load("paper"), reference("paper", TIMES_S, angles)) is None
    refusal = stepped.send(Approach())
    if not refused:
        assert refusal is None
        stepped.until("paused")
        stepped.send(Play())
        stepped.forward(0.5)
        assert stepped.mode == "playing"
        return
    assert refusal is not None
    assert refusal.code == "too_far_from_start"
    assert refusal.message.startswith("Motor 4 is 8° from the start of the recording")
    assert "8°" in refusal.next_step
    assert not stepped.torque
    stepped.forward(0.1)
    assert stepped.snapshot.refusals["approach"] == refusal


@given(st.floats(5.0, 100.0), st.floats(-9.0, 9.0), st.integers(0, 60), st.sampled_from([-2.0, 2.0]))
@examples(few=25, many=2_000)
def test_paper_method_begins_or_is_refused(
    tmp_path_factory: pytest.TempPathFactory, patient_deg_s: float, away_deg: float, cycles: int, push_nm: float
) -> None:
    """With a patient's speed limit of 20 deg/s, an accepted start of 4 to 8 deg was refused by the setpoint gate.

    The arm is pushed for some cycles while it is held before playing.
    """
    stepped = Stepped(tmp_path_factory.mktemp("run"), station())
    stepped.apparatus.angles_deg[MOVING] = 30.0 + away_deg
    stepped.forward(0.1)
    trajectory = reference("paper", TIMES_S, rows(from_deg=30.0, reach_deg=2.0))
    assert stepped.send(load("paper", max_speed_deg_s=patient_deg_s), trajectory) is None
    refusal = stepped.send(Approach())
    if refusal is not None:
        assert refusal.code == "too_far_from_start"
        assert abs(away_deg) > min(0.15 * patient_deg_s + 0.4, 7.9)
        return
    stepped.until("paused")
    stepped.apparatus.torques_nm[MOVING] = push_nm
    for _ in range(cycles):
        stepped.cycle()
    stepped.apparatus.torques_nm[MOVING] = 0.0
    refusal = stepped.send(Play())
    assert refusal is None or refusal.code == "too_far_from_start"
    stepped.forward(1.0)
    assert not OF_OUR_OWN.intersection(stepped.causes())


# In every run each motor once, and both protocols.
@pytest.mark.parametrize(("step_deg", "refused"), [(7.9, False), (8.1, True)])
@pytest.mark.parametrize(
    ("protocol", "motor"),
    [
        pytest.param(protocol, motor, marks=() if protocol == first else pytest.mark.campaign)
        for motor, first in ((3, "dynamixel"), (4, "modbus"), (5, "dynamixel"))
        for protocol in ("dynamixel", "modbus")
    ],
)
def test_paper_method_leaves_a_hold_or_is_refused(
    tmp_path: Path, protocol: Literal["dynamixel", "modbus"], motor: int, step_deg: float, refused: bool
) -> None:
    """The drive has not moved yet in the cycle after a step, and must not count as frozen."""
    config = msgspec.structs.replace(simulated("memory"), protocol=protocol)
    station = SimulatedLoop(tmp_path, config)
    times = np.arange(0.0, 4.01, 0.1)
    angles = np.tile(station.world.angles_deg, (len(times), 1))
    angles[:, motor - 1] += (-1.0 if motor == 5 else 1.0) * np.clip((times - 1.9) * 10.0 * step_deg, 0.0, 3 * step_deg)
    recording = load_of(times, angles, method="paper")
    if refused:
        refusal = station.send(recording)
        assert refusal is not None
        assert refusal.code == "unusable"
        assert f"motor {motor} moves by 8.1° in one step at 2." in refusal.message
        return
    station.play(recording, 3.5)
    assert station.causes() == []


@pytest.mark.parametrize("method", ["smooth", "learned"])
def test_other_methods_start_from_any_arm_position(tmp_path: Path, method: Method) -> None:
    stepped, trajectory = begin(tmp_path, station(), method, rows(from_deg=40.0))
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(trajectory.at(0.0)[MOVING])


def test_the_last_look_knows_the_rate_of_the_run(paper: Stepped) -> None:
    """At 10 Hz a step of 5 deg is 50 deg/s and allowed; a step of 24 deg is not."""
    paper.send(Play())
    until_place(paper, 1.0)
    assert np.abs(np.diff(sent(paper))).max() > 4.0
    assert paper.causes() == []
    movement = paper.loop._machine._movement
    assert movement is not None
    movement.position_s = 3.9  # as an internal defect would
    paper.forward(0.1)
    assert paper.causes() == ["setpoint_step"]
    assert not paper.torque


@pytest.mark.parametrize("method", METHODS)
def test_each_method_comes_to_its_end(tmp_path: Path, method: Method) -> None:
    stepped, _ = begin(tmp_path, station(lag_s=0.06, friction_deg=0.3), method)
    stepped.send(Play())
    stepped.until("idle")
    end = stepped.journal().end
    assert end is not None
    assert end.reason == "completed"
    assert stepped.causes() == []


# -- every accepted Load --------------------------------------------------------------------------------------------

MIDDLE_DEG = np.array((12.0, 108.0, 60.0, 60.0, -25.0))
Shape = Literal["short", "gaps", "steep", "steps", "swing"]
Act = Literal["play", "pause", "reduce_range", "push", "return", "wait"]


@st.composite
def samples(draw: st.DrawFn) -> tuple[Floats, Floats]:
    """Draw times and angles of one moving axis: short, with gaps, steep at the start, with steps, or at the speed
    limit.
    """
    shape = draw(st.sampled_from(get_args(Shape)))
    size_deg = draw(st.floats(1.0, 35.0))
    swing_hz = draw(st.floats(30.0, 145.0)) / size_deg / (2 * np.pi)
    if shape == "short":
        times = np.linspace(0.0, 10 ** draw(st.floats(-3.0, -1.0)), draw(st.integers(2, 4)))
    else:
        times = np.arange(0.0, draw(st.floats(0.1, 4.0)), draw(st.sampled_from([0.01, 0.02])))
        if shape == "gaps":
            times += 0.5 * (np.arange(len(times)) // draw(st.integers(5, 50)))
    lasts_s = times[-1]
    way = {
        "short": times / lasts_s if shape == "short" else times,
        "gaps": np.sin(times),
        "steep": 1.0 - np.exp(-times / 10 ** draw(st.floats(-2.0, 0.0))),
        "steps": (times > lasts_s * draw(st.floats(0.0, 1.0))).astype(np.float64),
        "swing": np.sin(2 * np.pi * swing_hz * times + draw(st.sampled_from([0.0, 1.0, 1.6]))),
    }[shape]
    angles = np.tile(MIDDLE_DEG, (len(times), 1))
    angles[:, draw(st.sampled_from([2, 3, 4]))] += size_deg * way
    return times, angles


def of_little_acceleration(config: StationConfig, speed_deg_s: float) -> StationConfig:
    """Return a station whose axes have hardly more acceleration than a reversal at their speed limit needs."""
    limits = {"max_speed_deg_s": speed_deg_s, "max_acceleration_deg_s2": 36.0 * speed_deg_s}
    return msgspec.structs.replace(config, axes=tuple(msgspec.structs.replace(axis, **limits) for axis in config.axes))


COMMANDS: dict[str, Command] = {
    "play": Play(),
    "pause": Pause(),
    "reduce_range": ReduceRange(),
    "return": Return(),
    "push": Pause(),
}


def do(stepped: Stepped, act: Act) -> None:
    """Apply one command or push to a run; it may be refused."""
    run = stepped.loop._machine._run
    if act == "push" and run is not None:
        rated_nm = [axis.max_torque_nm for axis in stepped.config.axes]
        stepped.apparatus.torques_nm = np.copysign(rated_nm, run._speed_deg_s).tolist()
        stepped.forward(0.12)
        stepped.apparatus.torques_nm = [0.0] * 5
    elif act != "wait":
        stepped.send(COMMANDS[act])


@given(
    samples(),
    st.sampled_from(METHODS),
    st.sampled_from([(0.0, 0.0, 0.0), (0.054, 0.0015, 0.08), (0.127, 0.0043, 0.28), (0.3, 0.02, 5.0)]),
    st.sampled_from([(100, 150.0), (100, 56.0), (50, 56.0), (10, 56.0)]),
    st.lists(st.tuples(st.integers(1, 120), st.sampled_from(get_args(Act))), max_size=5),
    st.sampled_from([None, 0.0, 0.1, 1.0, 5.0]),
)
@examples(few=30, many=300)
def test_whatever_load_accepts_plays_without_a_fault_of_our_own(
    tmp_path_factory: pytest.TempPathFactory,
    recording: tuple[Floats, Floats],
    method: Method,
    lag: tuple[float, float, float],
    station_is: tuple[int, float],
    acts: list[tuple[int, Act]],
    beyond_deg: float | None,
) -> None:
    """Approach, play, pause, reduce the range, reverse and return, with drives without a fault.

    ``beyond_deg``: distance of the doctor's limits beyond the recording, or None for no limits.
    """
    rate_hz, speed_deg_s = station_is
    config = of_little_acceleration(station(*lag, rate_hz=rate_hz), speed_deg_s)
    times, angles = recording
    command = load(
        method, times_s=times.astype("<f8").tobytes(), angles_deg=angles.astype("<f8").tobytes(), resistance_level=20
    )
    if beyond_deg is not None:
        ends = zip(angles.min(axis=0) - beyond_deg - 0.01, angles.max(axis=0) + beyond_deg + 0.01, strict=True)
        command = msgspec.structs.replace(command, limits_deg=tuple((float(low), float(high)) for low, high in ends))
    built = build(command, config)
    if isinstance(built, Refusal):
        return
    stepped = Stepped(tmp_path_factory.mktemp("run"), config)
    stepped.apparatus.angles_deg = angles[0].tolist()
    stepped.forward(0.1)
    assert stepped.send(command, built.trajectory) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    do(stepped, "play")
    for cycles, act in acts:
        for _ in range(cycles):
            stepped.cycle()
        do(stepped, act)
    for _ in range(1500):
        if stepped.mode not in ("playing", "returning"):
            break
        stepped.cycle()
    assert not OF_OUR_OWN.intersection(stepped.causes())


OF_OUR_OWN = {fault.code for fault in FAULTS if fault.code.startswith("setpoint_")} | {"unexpected_error"}


_LAGS = [(0.0, 0.0, 0.0), (0.3, 0.01, 0.6), (0.127, 0.02, 0.0)]
_ACTS: list[Act] = ["push", "pause", "reduce_range", "return", "wait"]


# In every run each act at both times, and each lag with several acts.
@pytest.mark.parametrize(
    ("act", "after_s", "lag"),
    [
        pytest.param(act, after_s, lag, marks=() if (n + late) % len(_LAGS) == m else pytest.mark.campaign)
        for n, act in enumerate(_ACTS)
        for late, after_s in enumerate((0.18, 0.4))
        for m, lag in enumerate(_LAGS)
    ],
)
def test_an_axis_of_little_acceleration_is_not_jerked(
    tmp_path: Path, act: Act, after_s: float, lag: tuple[float, float, float]
) -> None:
    """At 125 deg/s, with all of the acceleration that a reference may use; the recording ends in full motion."""
    config = station(*lag)
    config = of_little_acceleration(config, 126.0)
    turn_s = 2 * np.pi / 18.0
    times = np.arange(0.0, 3.0 * turn_s, 0.01)
    angles = np.tile(MIDDLE_DEG, (len(times), 1))
    angles[:, MOVING] += 6.9 * np.sin(18.0 * times)
    trajectory = reference("smooth", times, angles)
    config.check_reference("smooth", trajectory, "right")
    stepped = Stepped(tmp_path, config)
    stepped.apparatus.angles_deg = MIDDLE_DEG.tolist()
    stepped.forward(0.1)
    assert stepped.send(load("smooth", resistance_level=20), trajectory) is None
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    stepped.forward(turn_s + after_s)
    do(stepped, "pause" if act == "return" else act)
    while stepped.mode in ("playing", "returning", "paused"):
        if stepped.mode == "paused":
            stepped.send(Return() if act == "return" else Play())
        stepped.cycle()
    assert stepped.causes() == []
    assert stepped.mode == "idle"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("lasts_s", "refused"), [(0.001, True), (0.199, True), (0.2, False)])
def test_recording_shorter_than_a_start_and_a_stop_is_refused(method: Method, lasts_s: float, refused: bool) -> None:
    times = np.array([0.0, lasts_s])
    angles = np.tile(MIDDLE_DEG, (2, 1))
    angles[1, MOVING] += 4.0
    command = load(method, times_s=times.astype("<f8").tobytes(), angles_deg=angles.astype("<f8").tobytes())
    refusal = build(command, StationConfig())
    assert isinstance(refusal, Refusal) is refused
    if isinstance(refusal, Refusal):
        assert refusal.code == "unplayable"
        assert f"it lasts {lasts_s * 1000:.0f} ms; it must last at least 200 ms" in refusal.message
