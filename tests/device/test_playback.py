"""Playback with a stepped clock: load, approach, play, pause, return."""

from pathlib import Path

import numpy as np
import pytest

from kata.device import journal
from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, Load, Pause, Play, Return, Teach, Unload
from kata.motion.trajectory import Trajectory
from tests.support.stepped import REST_DEG, Stepped
from tests.support.trajectories import LOAD, a_trajectory


def test_torque_stays_off_until_the_approach_is_asked_for(stepped: Stepped) -> None:
    stepped.send(LOAD, a_trajectory())
    stepped.forward(1.0)

    assert stepped.mode == "ready"
    assert not stepped.torque
    assert stepped.apparatus.written == []


def test_approach_starts_at_the_arm_and_respects_its_speed_limit(stepped: Stepped) -> None:
    stepped.apparatus.angles_deg[3] = -10.0
    stepped.send(LOAD, a_trajectory())
    stepped.send(Approach())
    stepped.until("paused")

    written = np.array(stepped.apparatus.written)
    assert written[0] == pytest.approx([15.0, 109.0, 10.0, -10.0, 0.0])
    assert written[-1] == pytest.approx(a_trajectory().at(0.0))
    assert written[-1] == pytest.approx([15.0, 109.0, 10.0, 20.0, 0.0], abs=0.1)  # smoothed
    speed_deg_s = np.abs(np.diff(written[:, 3])) * stepped.config.rate_hz
    assert speed_deg_s.max() <= stepped.config.approach_speed_deg_s * 1.001
    run = stepped.snapshot.run
    assert run is not None
    assert run.at_start


def test_playback_runs_out_and_back_and_ends_without_torque(
    stepped: Stepped,
) -> None:
    trajectory = a_trajectory()
    stepped.send(LOAD, trajectory)
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    stepped.until("returning")
    stepped.until("idle")

    assert not stepped.torque
    assert stepped.apparatus.angles_deg == pytest.approx(list(REST_DEG), abs=0.01)
    recorded = stepped.journal()
    assert recorded.kind == "run"
    assert recorded.id == "run"
    assert recorded.end is not None
    assert recorded.end.reason == "completed"
    played = recorded.phase == journal.PHASE_PLAYING
    assert recorded.path_s[played][0] == pytest.approx(0.0, abs=0.011)
    assert recorded.path_s[played][-1] == pytest.approx(trajectory.duration_s, abs=0.011)
    taught = np.array([trajectory.at(at) for at in recorded.path_s[played]])
    assert np.abs(recorded.measured_deg[played] - taught).max() < 1.0


def test_pause_holds_with_torque_and_playback_resumes_there(playing: Stepped) -> None:
    assert playing.send(Pause()) is None
    playing.until("paused")
    held = list(playing.apparatus.angles_deg)
    playing.forward(3.0)
    assert playing.apparatus.angles_deg == pytest.approx(held, abs=0.2)
    assert playing.torque

    assert playing.send(Play()) is None
    playing.until("idle")
    recorded = playing.journal()
    path_s = recorded.path_s[recorded.phase == journal.PHASE_PLAYING]
    assert np.all(np.diff(path_s) >= 0)
    assert path_s[-1] == pytest.approx(2.0, abs=0.011)


def test_second_pause_reports_whether_the_first_is_complete(playing: Stepped) -> None:
    assert playing.send(Pause()) is None
    refusal = playing.send(Pause())
    assert refusal is not None
    assert refusal.code == "is_pausing"
    playing.until("paused")
    refusal = playing.send(Pause())
    assert refusal is not None
    assert refusal.code == "is_paused"


def test_no_setpoint_ever_jumps(playing: Stepped) -> None:
    playing.send(Pause())
    playing.until("paused")
    playing.send(Play())
    playing.until("idle")

    steps = np.abs(np.diff(np.array(playing.apparatus.written), axis=0))
    assert steps.max() < 0.6  # the recording's own fastest step is 0.32 deg


def test_return_from_a_pause_ends_the_run_as_returned(playing: Stepped) -> None:
    playing.send(Pause())
    playing.until("paused")
    assert playing.send(Return()) is None
    playing.until("idle")

    assert not playing.torque
    end = playing.journal().end
    assert end is not None
    assert end.reason == "returned"


def test_unload_ends_the_run_unplayed(stepped: Stepped) -> None:
    stepped.send(LOAD, a_trajectory())
    assert stepped.send(Unload()) is None

    assert stepped.mode == "idle"
    recorded = stepped.journal()
    assert len(recorded.t_ns) == 0
    assert recorded.end is not None
    assert recorded.end.reason == "unloaded"


def test_remaining_time_counts_down_to_zero(playing: Stepped) -> None:
    left = []
    while playing.mode == "playing":
        run = playing.snapshot.run
        assert run is not None
        left.append(run.left_s)
        playing.cycle()

    assert left == sorted(left, reverse=True)
    assert left[0] <= 1.65
    assert left[-1] < 0.2


@pytest.mark.parametrize(
    ("rate_hz", "between_s"),
    [(10, 0.1), (50, 0.02), (100, 0.01)],
)
def test_samples_and_setpoints_go_at_the_stations_rate(tmp_path: Path, rate_hz: int, between_s: float) -> None:
    stepped = Stepped(tmp_path, StationConfig(rate_hz=rate_hz))
    stepped.send(LOAD, a_trajectory())
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    stepped.until("idle")

    recorded = stepped.journal()
    assert recorded.rate_hz == rate_hz
    assert np.diff(recorded.t_ns) == pytest.approx(between_s * 1e9)
    assert len(stepped.apparatus.written) == pytest.approx(len(recorded.t_ns), abs=2)


@pytest.mark.counted
def test_an_arm_outside_its_range_is_not_approached_with(stepped: Stepped) -> None:
    stepped.apparatus.angles_deg[4] = 60.0
    stepped.send(LOAD, a_trajectory())
    refusal = stepped.send(Approach())

    assert refusal is not None
    assert refusal.code == "outside_range"
    assert "Motor 5" in refusal.message
    assert not stepped.torque


@pytest.mark.parametrize("command", [Approach(), Play(), Pause(), Return(), Unload()])
def test_command_needing_a_recording_is_refused_without_one(
    stepped: Stepped, command: Approach | Play | Pause | Return | Unload
) -> None:
    refusal = stepped.send(command)

    assert refusal is not None
    assert refusal.code == "is_idle"
    assert refusal.message == "No recording is loaded."


@pytest.mark.parametrize("command", [LOAD, Teach(teaching_id="t"), Approach(), Unload()])
def test_while_playing_nothing_else_can_begin(playing: Stepped, command: Load | Teach | Approach | Unload) -> None:
    refusal = playing.send(command, a_trajectory())

    assert refusal is not None
    assert refusal.code == "is_playing"
    assert playing.mode == "playing"


def test_snapshot_lists_allowed_commands_and_reasons_for_the_others(playing: Stepped) -> None:
    refusals = playing.snapshot.refusals
    assert set(refusals) == {
        "teach", "finish_teaching", "load", "unload", "approach", "play", "return", "release_torque", "acknowledge",
    }  # fmt: skip
    assert refusals["play"].message == "The recording is playing."


def test_arm_waits_at_the_start_and_playback_begins_at_rest(stepped: Stepped) -> None:
    stepped.send(LOAD, a_trajectory())
    stepped.send(Approach())
    stepped.until("paused")
    stepped.forward(2.0)
    run = stepped.snapshot.run
    assert run is not None
    assert run.position_s == 0.0
    assert stepped.apparatus.angles_deg[3] == pytest.approx(20.0, abs=0.1)

    stepped.send(Play())
    stepped.forward(0.5)
    run = stepped.snapshot.run
    assert run is not None
    # Half a second minus the ramp to full speed: 0.1 s and half a cycle.
    assert run.position_s == pytest.approx(0.5 - 0.095)


def test_the_approach_ends_exactly_where_the_recording_begins(stepped: Stepped) -> None:
    times = np.linspace(0.0, 2.0, 21)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 3] = 20.0 + 10.0 * times
    stepped.send(LOAD, Trajectory(times, angles))
    stepped.send(Approach())
    stepped.until("paused")
    assert stepped.apparatus.angles_deg[3] == pytest.approx(20.0, abs=1e-6)
