"""Teaching, playback and stops in real time: the device process and the simulated apparatus on a pseudo-terminal."""

import os
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import pytest

from kata.device import journal
from kata.device.config import Inputs
from kata.device.ipc_messages import (
    RESISTANCE_LEVELS,
    Acknowledge,
    Approach,
    FinishTeaching,
    Load,
    Play,
    ReleaseTorque,
    Teach,
)
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import Floats
from kata.motion.taught import Taught
from kata.motion.tracking import compare
from tests.support.motion_samples import Samples, known
from tests.support.rig import Rig

ESTOP_LIMIT_MS = 20.0


class SharedRig:
    """The processes for all tests after which both still run."""

    def __init__(self, folders: pytest.TempPathFactory) -> None:
        self._folders = folders
        self._rig: Rig | None = None

    def started(self) -> Rig:
        """Return the running processes, or start them."""
        if self._rig is None:
            self._rig = Rig(self._folders.mktemp("rig"))
        self._rig.until_mode("idle")
        return self._rig

    def close(self) -> None:
        if self._rig is not None:
            self._rig.close()
        self._rig = None


@pytest.fixture(scope="module")
def shared_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRig]:
    with closing(SharedRig(tmp_path_factory)) as shared:
        yield shared


@pytest.fixture
def rig(shared_rig: SharedRig) -> Iterator[Rig]:
    """Return processes that are idle, and leave them so. After a test that has failed on the way, the next one gets new ones."""
    rig = shared_rig.started()
    rig.events.clear()
    yield rig
    if rig.snapshot.mode not in ("idle", "stopped") or not rig.answered:
        shared_rig.close()
        return
    rig.heartbeats, rig.believed = True, None
    rig.hand.clear_faults()
    rig.hand.estop(pressed=False)
    rig.until(lambda: rig.snapshot.mode == "idle" or "acknowledge" not in rig.snapshot.refusals)
    if rig.snapshot.mode == "stopped":
        assert rig.send(Acknowledge()) is None
        rig.until_mode("idle")


def teach(rig: Rig, motion: Taught) -> journal.Journal:
    """Teach a motion with the simulated hand and pedal, and return the journal."""
    rig.until_mode("idle")
    assert rig.send(Teach(teaching_id="teaching")) is None
    rig.hand.guide(motion)
    rig.until(lambda: rig.hand.state().hand.phase == "away", within_s=motion.duration_s + 30)
    assert rig.send(FinishTeaching()) is None
    rig.until(lambda: rig.closed)
    return journal.read(rig.closed[-1])


def recorded(taught: journal.Journal) -> Samples:
    return Samples((taught.t_ns - taught.t_ns[0]) / 1e9, taught.measured_deg.astype(np.float64))


def apart_deg(taught: Samples, motion: Samples, beat_s: float) -> float:
    """Return the largest difference between the extremes of the recording and of the hand's motion, at the recorded times.

    A motion may turn back within 0.2 s: missed cycles record nothing of it. The time of the pedal is known to one cycle of the
    loop.
    """

    def extremes(angles_deg: Floats) -> Floats:
        return np.concatenate([angles_deg.min(axis=0), angles_deg.max(axis=0)])

    def hand_deg(late_s: float) -> Floats:
        times_s = taught.times_s + late_s
        return np.column_stack([np.interp(times_s, motion.times_s, axis_deg) for axis_deg in motion.angles_deg.T])

    beat = np.linspace(-beat_s, beat_s, 21)
    return min(float(np.abs(extremes(taught.angles_deg) - extremes(hand_deg(late))).max()) for late in beat)


def load(
    rig: Rig,
    recording: Samples,
    run_id: str = "",
    resistance_level: int = RESISTANCE_LEVELS,
    until: tuple[str, ...] = ("paused",),
) -> str:
    """Load the recording, move to its start and return the run's id."""
    rig.until_mode("idle")
    run_id = run_id or uuid4().hex
    command = Load(
        run_id=run_id,
        recording_id="recording",
        times_s=recording.times_s.astype("<f8").tobytes(),
        angles_deg=recording.angles_deg.astype("<f8").tobytes(),
        resistance_level=resistance_level,
    )
    assert rig.send(command) is None
    assert rig.send(Approach()) is None
    rig.until(lambda: rig.snapshot.mode in until, within_s=60.0)
    return run_id


def play_once(rig: Rig, recording: Samples, run_id: str) -> bool:
    """Return True if the playback reached the way back without a stop."""
    load(rig, recording, run_id, until=("paused", "stopped"))
    if rig.snapshot.mode == "paused":
        assert rig.send(Play()) is None
        rig.until(lambda: rig.snapshot.mode in ("returning", "stopped"), within_s=60.0)
    return rig.snapshot.mode == "returning"


DYNAMIXEL_10, DYNAMIXEL_100 = {"rate_hz": 10}, {"rate_hz": 100}
MODBUS_AS_SLOW_AS_MOST = {
    "protocol": "modbus",
    "baud": 115_200,
    "rate_hz": 25,
    "cycle_hz": 25,
    "inputs": Inputs(max_age_cycles=7, estop_second_port=3),
}


# tests/api/test_demo.py teaches and plays at 10 Hz.
@pytest.mark.parametrize(
    "station",
    [
        DYNAMIXEL_100,
        *(pytest.param(station, marks=pytest.mark.campaign) for station in (DYNAMIXEL_10, MODBUS_AS_SLOW_AS_MOST)),
    ],
)
def test_teach_play_back_and_compare(tmp_path: Path, motion: Taught, station: dict[str, Any]) -> None:
    rate_hz = station["rate_hz"]
    with closing(Rig(tmp_path, **station)) as rig:
        taught = teach(rig, motion)

        assert set(taught.take) == {1}
        # A busy computer misses cycles or answers too late, most of all on a bus with little reserve. No more samples are missing
        # than the loop reports, and the others lie on its cycle.
        missed = rig.snapshot.loop.overruns + rig.snapshot.loop.bus_errors
        wanted = motion.duration_s * rate_hz
        assert wanted * 0.9 - missed <= len(taught.t_ns) <= wanted * 1.1
        beats = np.diff(taught.t_ns) * (rate_hz / 1e9)
        assert np.median(beats[np.round(beats) == 1]) == pytest.approx(1, rel=0.02)
        assert np.round(beats).sum() == pytest.approx(wanted, rel=0.1)
        assert apart_deg(recorded(taught), known(motion), 1 / rate_hz) <= 1.5

        # A delayed simulator answers too late and the device stops, as required. Then try again.
        for attempt in range(8):
            errors = rig.snapshot.loop.bus_errors
            if play_once(rig, recorded(taught), f"run-{attempt}"):
                break
            assert rig.snapshot.loop.bus_errors > errors
            rig.until(lambda: "acknowledge" not in rig.snapshot.refusals)
            assert rig.send(Acknowledge()) is None
            rig.until_mode("idle")
        rig.until_mode("idle")
        rig.until(lambda: rig.closed[-1].stem.endswith(f"run-{attempt}"))

        run = journal.read(rig.closed[-1])
        assert run.end is not None
        assert run.end.reason == "completed"
        played = run.phase == journal.PHASE_PLAYING
        times_s = (taught.t_ns - taught.t_ns[0]) / 1e9
        compared = compare(times_s, taught.measured_deg, run.path_s[played], run.measured_deg[played])
        for motor in compared.motors:
            assert abs(motor.start_deg) <= 1.0
            assert abs(motor.peak_deg) <= 6.0
        assert not any(axis.torque_on for axis in rig.hand.state().axes)


def press_and_measure_ms(rig: Rig) -> float:
    """Press the emergency stop in playback. Return the time until all five drives are without torque, by the simulator's clock."""
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.position_s > 0.5)
    rig.hand.estop(pressed=True)
    rig.until_mode("stopped")
    rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))
    pressed_ns = rig.happened("estop_pressed")[-1].t_ns
    off = [event for event in rig.happened("torque_off") if event.t_ns >= pressed_ns]
    assert {event.motor for event in off} == {1, 2, 3, 4, 5}
    return max(event.t_ns - pressed_ns for event in off) / 1e6


def release_and_acknowledge(rig: Rig) -> None:
    """Reset after an emergency stop. Neither of the two actions starts anything."""
    refusal = rig.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "estop_pressed"
    rig.hand.estop(pressed=False)
    rig.until(lambda: rig.snapshot.estop == "released" and "acknowledge" not in rig.snapshot.refusals)
    assert not any(axis.torque_on for axis in rig.hand.state().axes)
    assert rig.send(Acknowledge()) is None
    rig.until_mode("idle")


def press_within_limit(rig: Rig) -> None:
    """Repeat a press during which the loop missed cycles: it measures the computer, not the device."""
    recording = known(built_in_motions()[0])
    for _ in range(5):
        load(rig, recording)
        assert rig.send(Play()) is None
        overruns = rig.snapshot.loop.overruns
        lasted_ms = press_and_measure_ms(rig)
        release_and_acknowledge(rig)
        if rig.snapshot.loop.overruns == overruns:
            assert lasted_ms <= ESTOP_LIMIT_MS
            return
    pytest.fail("the computer stood still in every attempt")


def test_emergency_stop_cuts_torque_and_everything_restarts(rig: Rig, motion: Taught) -> None:
    press_within_limit(rig)
    refusal = rig.send(Play())
    assert refusal is not None
    assert refusal.code == "is_idle"
    load(rig, known(motion))
    assert rig.send(Play()) is None
    rig.until_mode("idle", within_s=motion.duration_s + 30)


# The cycle in which the contact is read is the same at every rate of setpoints.
@pytest.mark.campaign
def test_emergency_stop_cuts_torque_at_10_hz(tmp_path: Path) -> None:
    with closing(Rig(tmp_path, rate_hz=10)) as rig:
        press_within_limit(rig)


def test_a_service_that_hangs_stops_the_playback(rig: Rig, motion: Taught) -> None:
    load(rig, known(motion))
    assert rig.send(Play()) is None
    rig.heartbeats = False
    rig.until_mode("stopped")

    assert [cause.code for cause in rig.snapshot.stop.causes] == ["service_silent"] if rig.snapshot.stop else False
    rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))


def test_disagreeing_service_stops_the_playback(rig: Rig, motion: Taught) -> None:
    rig.believed = "agreed"
    load(rig, known(motion), "agreed")
    assert rig.send(Play()) is None
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.position_s > 0.5)
    assert rig.snapshot.mode == "playing"
    rig.believed = "another"
    rig.until_mode("stopped")

    assert [cause.code for cause in rig.snapshot.stop.causes] == ["other_run"] if rig.snapshot.stop else False
    rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))


def test_repeated_resistance_in_one_place_stops_and_holds_the_arm(rig: Rig) -> None:
    flexion = built_in_motions()[4]
    run_id = load(rig, known(flexion), resistance_level=8)
    # Jam it from the start: an axis that jams later cannot be taken back either, which is another fault.
    rig.hand.fault("stuck", 4)
    assert rig.send(Play()) is None
    # A shaft that stays jammed cannot be taken back.
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.reversals == 1)
    rig.hand.clear_faults()
    rig.until_mode("paused")

    run = rig.snapshot.run
    assert run is not None
    assert (run.reversals, run.reversing) == (1, True)
    assert any(event.code == "load_reversal" and "Motor 4" in event.message for event in rig.events)
    assert rig.snapshot.stop is None

    rig.hand.fault("stuck", 4)
    assert rig.send(Play()) is None
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.reversals == 2)
    rig.hand.clear_faults()
    rig.until_mode("stopped")
    rig.until(lambda: "acknowledge" not in rig.snapshot.refusals)
    stop = rig.snapshot.stop
    assert stop is not None
    assert [(cause.code, cause.category, cause.axis) for cause in stop.causes] == [("load_repeated", 2, 4)]
    assert rig.snapshot.torque == "on"
    assert all(axis.torque_on for axis in rig.hand.state().axes)

    assert rig.send(Acknowledge()) is None
    rig.until_mode("idle")
    rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))
    rig.until(lambda: rig.closed[-1].stem.endswith(run_id))
    end = journal.read(rig.closed[-1]).end
    assert end is not None
    assert (end.reason, end.cause_code) == ("stopped", "load_repeated")


@pytest.mark.campaign
def test_dead_service_leaves_torque_off_and_a_complete_journal(tmp_path: Path, motion: Taught) -> None:
    with closing(Rig(tmp_path)) as rig:
        load(rig, known(motion), "run")
        assert rig.send(Play()) is None
        rig.until(lambda: rig.snapshot.run and rig.snapshot.run.position_s > 0.5)
        rig.hang_up()
        assert rig.device.wait(10) == 0

        assert not any(axis.torque_on for axis in rig.hand.state().axes)
        run = journal.read(rig.journals / "run-run.journal")
        assert run.end is not None
        assert run.end.cause_code == "service_silent"


def all_cleared(rig: Rig) -> bool:
    stop = rig.snapshot.stop
    return stop is not None and all(cause.cleared for cause in stop.causes)


def test_frozen_apparatus_is_reported_and_nothing_moves_when_it_returns(rig: Rig) -> None:
    rig.until_mode("idle")
    os.kill(rig.simulator.pid, signal.SIGSTOP)
    rig.until_mode("stopped")
    os.kill(rig.simulator.pid, signal.SIGCONT)
    rig.until(lambda: all_cleared(rig) and "acknowledge" not in rig.snapshot.refusals)
    assert rig.snapshot.mode == "stopped"
    assert rig.send(Acknowledge()) is None
    rig.until_mode("idle")


def test_unplugged_adapter_stops_playback_and_replugging_starts_nothing(rig: Rig, motion: Taught) -> None:
    load(rig, known(motion))
    assert rig.send(Play()) is None
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.position_s > 0.5)
    rig.hand.fault("gone")
    rig.until_mode("stopped")
    assert rig.snapshot.stop is not None
    assert rig.snapshot.stop.causes[0].code == "bus_lost"

    # The drives hold the arm until a user confirms that it is supported.
    assert rig.snapshot.torque == "unknown"
    rig.hand.clear_faults()
    rig.until(lambda: "release_torque" not in rig.snapshot.refusals)
    assert all(axis.torque_on for axis in rig.hand.state().axes)
    assert rig.send(ReleaseTorque()) is None
    rig.until(lambda: all_cleared(rig) and "acknowledge" not in rig.snapshot.refusals)
    assert not any(axis.torque_on for axis in rig.hand.state().axes)
    assert rig.send(Acknowledge()) is None
    rig.until_mode("idle")
    assert not any(axis.torque_on for axis in rig.hand.state().axes)


# In every run, tests/device/test_matrix.py has the campaign's two failures.
@pytest.mark.parametrize(
    "kind", [*(pytest.param(kind, marks=pytest.mark.campaign) for kind in ("garbage", "off")), "duplicate_id"]
)
def test_failing_drive_stops_the_playback_and_is_named(rig: Rig, motion: Taught, kind: Any) -> None:
    load(rig, known(motion))
    assert rig.send(Play()) is None
    rig.hand.fault(kind, motor=4)
    rig.until_mode("stopped")
    rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))
    assert rig.snapshot.stop is not None
    cause = rig.snapshot.stop.causes[0]
    assert cause.code == ("drive_silent" if kind == "off" else "drive_garbled")
    assert cause.message.startswith("Motor 4")
