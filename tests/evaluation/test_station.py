"""The station on virtual time behaves like the real one and is deterministic."""

from collections.abc import Sequence

import numpy as np
import pytest

from kata.commissioning.direct_station import PlaybackError, RefusedPlayError
from kata.device.config import simulated
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING, Journal
from kata.evaluation.station import VirtualStation
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.motion.trajectory import Trajectory
from kata.simulator.drive import Drive
from kata.simulator.effort import steady_push
from kata.simulator.parameters import REST_DEG
from kata.simulator.plant import Plant


def load(taught: Journal, **given: object) -> Load:
    times_s = (taught.t_ns - taught.t_ns[0]) / 1e9
    angles = {"times_s": times_s.tobytes(), "angles_deg": taught.measured_deg.astype("<f8").tobytes()}
    return Load(**{"run_id": "run", "recording_id": "recording", **angles, **given})


def test_motion_is_taught_by_hand_and_pedal_and_played_completely(short: Taught) -> None:
    station = VirtualStation(simulated("virtual"))
    taught = station.teach(short)
    run = station.play(load(taught), short.duration_s)

    assert taught.kind == "teaching"
    assert set(taught.take) == {1}
    assert len(taught.t_ns) == pytest.approx(100 * short.duration_s, rel=0.1)
    wanted = motor_angles_deg(short.poses_deg)
    assert taught.measured_deg.max(axis=0) == pytest.approx(wanted.max(axis=0), abs=1.5)
    assert run.end is not None
    assert run.end.reason == "completed"
    path_s = run.path_s[run.phase == PHASE_PLAYING]
    assert path_s[0] < 0.02
    assert path_s[-1] == pytest.approx((taught.t_ns[-1] - taught.t_ns[0]) / 1e9, abs=0.02)


class HeavyArm(Plant):
    """An arm that pulls motor 4 down by 6 Nm once its drive has torque: the therapist's hands hold it before."""

    def advance(self, drives: Sequence[Drive], steps: int) -> None:
        if drives[3].torque_on:
            self.joints[3].hand = steady_push(-6.0)
        super().advance(drives, steps)


def test_arm_too_heavy_for_a_motor_counts_as_refused(short: Taught) -> None:
    """Only the motor shows it: the load of the station is not identified."""
    station = VirtualStation(simulated("virtual"), make_mechanics=HeavyArm)
    taught = station.teach(short)
    with pytest.raises(RefusedPlayError, match=r"Motor 4 reached .* the arm is too heavy"):
        station.play(load(taught), short.duration_s)


def test_arm_does_not_overshoot_where_a_fast_rotation_stops() -> None:
    """Motor 5 lags most, by 0.13 s. It reaches 60 deg/s in 0.3 s and rest in 0.2 s."""
    times = np.arange(0.0, 1.6, 0.01)
    starts, stops = np.clip((times - 0.2) / 0.3, 0.0, 1.0), np.clip((0.9 - times) / 0.2, 0.0, 1.0)
    speed_deg_s = 15.0 * (1 - np.cos(np.pi * starts)) * (1 - np.cos(np.pi * stops))
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 4] -= np.cumsum(speed_deg_s) * 0.01
    recording = Load(run_id="run", recording_id="recording", times_s=times.tobytes(), angles_deg=angles.tobytes())
    run = VirtualStation(simulated("virtual")).play(recording, times[-1])
    playing = run.phase == PHASE_PLAYING
    error_deg = run.measured_deg[playing, 4] - Trajectory(times, angles).along(run.path_s[playing])[:, 4]
    assert np.abs(error_deg).max() < 1.0
    assert np.sqrt(np.mean(error_deg**2)) < 0.3


@pytest.mark.campaign
def test_same_seed_gives_the_same_samples_and_other_seeds_differ(short: Taught) -> None:
    def played(seed: int) -> Journal:
        station = VirtualStation(simulated("virtual"), seed)
        return station.play(load(station.teach(short)), short.duration_s)

    first, again, other = played(1), played(1), played(2)
    for name in ("t_ns", "phase", "setpoint_deg", "measured_deg", "torque_nm"):
        assert np.array_equal(getattr(first, name), getattr(again, name)), name
    assert np.array_equal(first.path_s, again.path_s, equal_nan=True)
    assert not np.array_equal(first.measured_deg, other.measured_deg)


def test_station_refusal_is_reported_in_its_words(short: Taught) -> None:
    station = VirtualStation(simulated("virtual"))
    taught = station.teach(short)
    with pytest.raises(PlaybackError, match="cannot be played: its resistance level must be"):
        station.play(load(taught, resistance_level=0), short.duration_s)


def test_station_stop_is_reported_in_its_words(short: Taught) -> None:
    station = VirtualStation(simulated("virtual"))
    taught = station.teach(short)
    station._world.apparatus.press_estop(True)
    with pytest.raises(PlaybackError, match="The emergency stop was pressed"):
        station.play(load(taught), short.duration_s)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [None, 17])
def test_motion_begins_alike_from_either_side_of_its_start(short: Taught, seed: int | None) -> None:
    """Gear backlash and friction must be the same at each start, or a learned correction does not fit."""
    station = VirtualStation(simulated("virtual"), seed)
    taught = station.teach(short)

    def play_from(offset_deg: float) -> Journal:
        poses = np.array([short.poses_deg[0] + offset_deg] * 2)
        station.reposition(Taught("put back", np.array([0.0, 0.5]), poses))
        return station.play(load(taught), short.duration_s)

    below, above = play_from(-3.0), play_from(3.0)
    for run in (below, above):
        assert run.end is not None
        assert run.end.reason == "completed"
    # During the first second; the limit is three counts of an encoder.
    grid = np.arange(0.0, 1.0, 0.01)
    paths = [
        np.column_stack([np.interp(grid, run.path_s[on], axis[on]) for axis in run.measured_deg.T])
        for run in (below, above)
        for on in [run.phase == PHASE_PLAYING]
    ]
    assert np.abs(paths[0] - paths[1]).max() <= 3 * 360 / 4096
