"""Modes: every allowed transition and no other, what each command needs, and a stop in each mode."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import pytest

from kata.device import state_machine, state_machine_base
from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.ipc_messages import (
    COMMAND_NAMES,
    Acknowledge,
    Approach,
    CommandName,
    FinishTeaching,
    Mode,
    Pause,
    Play,
    Return,
    Teach,
    Unload,
)
from kata.device.movement import Movement
from kata.motion.axes import Side
from tests.support.stepped import Stepped, SteppedApparatus
from tests.support.trajectories import LOAD, a_trajectory

WAYS: dict[Mode, tuple[Mode, ...]] = {
    "offline": ("idle", "stopped"),
    "idle": ("teaching", "ready", "stopped"),
    "teaching": ("idle", "stopped"),
    "ready": ("idle", "approaching", "stopped"),
    "approaching": ("paused", "stopped"),
    "paused": ("playing", "returning", "stopped"),
    "playing": ("paused", "returning", "stopped"),
    "returning": ("idle", "stopped"),
    "stopped": ("idle",),
}
ALLOWED: dict[Mode, tuple[CommandName, ...]] = {
    "offline": (),
    "idle": ("teach", "load"),
    "teaching": ("finish_teaching",),
    "ready": ("unload", "approach"),
    "approaching": (),
    "paused": ("play", "reduce_range", "return"),
    "playing": ("pause", "reduce_range"),
    "returning": (),
    "stopped": ("acknowledge",),
}
WITH_TORQUE: tuple[Mode, ...] = ("approaching", "paused", "playing", "returning")
WITHOUT: tuple[Mode, ...] = ("idle", "teaching", "ready")


def bring(stepped: Stepped, mode: Mode) -> Stepped:
    """Bring the apparatus into a mode by commands only."""

    def load() -> None:
        assert stepped.send(LOAD, a_trajectory()) is None

    def approach() -> None:
        load()
        assert stepped.send(Approach()) is None
        stepped.forward(0.3)

    def pause() -> None:
        approach()
        stepped.until("paused")

    def play() -> None:
        pause()
        assert stepped.send(Play()) is None
        stepped.forward(0.5)

    def go_back() -> None:
        pause()
        assert stepped.send(Return()) is None
        stepped.forward(0.3)

    def stop() -> None:
        stepped.apparatus.estop_open = True
        stepped.cycle()
        stepped.apparatus.estop_open = False
        stepped.cycle()

    steps: dict[Mode, Callable[[], object]] = {
        "teaching": lambda: stepped.send(Teach(teaching_id="t")),
        "ready": load,
        "approaching": approach,
        "paused": pause,
        "playing": play,
        "returning": go_back,
        "stopped": stop,
    }
    steps.get(mode, lambda: None)()
    stepped.cycle()
    assert stepped.mode == mode
    return stepped


def events(stepped: Stepped, code: str) -> list[str]:
    return [event.message for event in stepped.link.events if event.code == code]


# -- sides ------------------------------------------------------------------------------------------------------------


@pytest.mark.counted
@pytest.mark.parametrize(("stands_for", "wanted"), [("right", "left"), ("left", "right")])
def test_only_the_current_sides_shoulder_is_taught_or_played(tmp_path: Path, stands_for: Side, wanted: Side) -> None:
    stepped = Stepped(tmp_path, StationConfig(side=stands_for))
    load = msgspec.structs.replace(LOAD, side=wanted)
    for refusal in (stepped.send(Teach(teaching_id="t", side=wanted)), stepped.send(load, a_trajectory())):
        assert refusal is not None
        assert refusal.code == "other_side"
        assert (
            refusal.message
            == f"This is for the {wanted} shoulder, but the apparatus is set up for the {stands_for} shoulder."
        )
    assert stepped.mode == "idle"
    assert stepped.link.journals == []
    assert stepped.send(msgspec.structs.replace(load, side=stands_for), a_trajectory()) is None


# -- ways and commands ------------------------------------------------------------------------------------------------


def test_only_the_documented_mode_transitions_exist() -> None:
    assert set(state_machine_base.TRANSITIONS) == {(come, go) for come, ways in WAYS.items() for go in ways}
    assert all(state_machine_base.TRANSITIONS.values())


@pytest.mark.parametrize("mode", ALLOWED)
def test_each_mode_allows_its_commands_and_explains_every_refusal(tmp_path: Path, mode: Mode) -> None:
    apparatus = SteppedApparatus(silent={0} if mode == "offline" else set())
    stepped = bring(Stepped(tmp_path, apparatus=apparatus), mode)
    stepped.forward(0.1)
    refusals = stepped.snapshot.refusals

    assert set(COMMAND_NAMES) - set(refusals) == {*ALLOWED[mode], "stop"}
    for name, refusal in refusals.items():
        nothing_to_do = {"acknowledge": "not_stopped", "finish_teaching": "not_teaching"}
        if mode == "stopped":
            nothing_to_do["release_torque"] = "no_torque_found"
        assert refusal.code == nothing_to_do.get(name, f"is_{mode}")
        assert refusal.message.endswith(".")
        assert refusal.next_step.endswith(".")


def test_stop_is_never_refused_even_while_another_cause_remains(stepped: Stepped) -> None:
    stepped.apparatus.estop_open = True
    stepped.forward(0.2)
    assert "acknowledge" in stepped.snapshot.refusals
    assert "stop" not in stepped.snapshot.refusals


def test_a_refused_command_changes_nothing(stepped: Stepped) -> None:
    bring(stepped, "ready")
    refusal = stepped.send(LOAD, a_trajectory())
    assert refusal is not None
    assert refusal.code == "is_ready"
    assert len(stepped.link.journals) == 1


@pytest.mark.counted
def test_invalid_mode_transition_stops_at_once(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    def astray(machine: state_machine.StateMachine, state: CycleState) -> None:
        machine._enter("teaching")

    monkeypatch.setitem(state_machine.StateMachine._STEPS, "playing", astray)
    playing.cycle()

    assert playing.mode == "stopped"
    assert not playing.torque
    assert playing.causes() == ["unexpected_error"]
    refusal = playing.send(Acknowledge())
    assert refusal is None  # the fault has passed with that cycle


def test_every_event_is_numbered_without_gaps(stepped: Stepped) -> None:
    bring(stepped, "playing")
    stepped.until("idle")
    numbered = stepped.link.events
    assert [event.number for event in numbered] == list(range(1, len(numbered) + 1))
    assert events(stepped, "mode") == ["idle", "ready", "approaching", "paused", "playing", "returning", "idle"]
    assert events(stepped, "torque") == ["Torque is on.", "Torque is being switched off."]
    times = [event.t_ns for event in numbered]
    assert times == sorted(times)
    assert times[0] < times[-1]


# -- stop -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", WITH_TORQUE)
def test_stop_ramps_down_while_torque_is_on_and_cuts_it(stepped: Stepped, mode: Mode) -> None:
    bring(stepped, mode)
    stepped.link.request_stop()
    stepped.cycle()
    assert stepped.mode == "stopped"
    assert stepped.causes() == ["operator_stop"]
    assert events(stepped, "fault") == ["Stopped by the operator. (stop category 1)"]
    # A held arm is at rest already.
    assert stepped.torque == (mode != "paused")

    stepped.forward(0.25)
    assert not stepped.torque
    end = stepped.journal().end
    assert end is not None
    assert (end.reason, end.cause_code, end.cause_message) == ("stopped", "operator_stop", "Stopped by the operator.")
    steps_deg = np.abs(np.diff(np.array(stepped.apparatus.written), axis=0))
    assert steps_deg.max() < 0.6


def test_stops_loads_and_reversals_are_counted_from_zero(stepped: Stepped) -> None:
    machine = stepped.loop._machine
    assert (machine.stops_latched, machine.loaded_runs_and_reversals) == (0, 0)


def test_a_stop_in_idle_latches_nothing_and_counts(stepped: Stepped) -> None:
    before = stepped.snapshot.stops
    stepped.link.request_stop()
    stepped.forward(0.1)
    assert stepped.mode == "idle"
    assert stepped.causes() == []
    assert stepped.snapshot.stops == before + 1


def test_a_stop_in_ready_ends_the_run(stepped: Stepped) -> None:
    bring(stepped, "ready")
    stepped.link.request_stop()
    stepped.forward(0.1)
    assert stepped.mode == "stopped"
    assert stepped.causes() == ["operator_stop"]
    end = stepped.journal().end
    assert end is not None
    assert (end.reason, end.cause_code) == ("stopped", "operator_stop")
    assert stepped.send(Acknowledge()) is None
    assert stepped.mode == "idle"


def test_further_stop_is_another_cause_and_is_reported_once(stepped: Stepped) -> None:
    bring(stepped, "stopped")
    for _ in range(3):
        stepped.link.request_stop()
        stepped.cycle()
    assert stepped.causes() == ["estop_pressed", "operator_stop"]
    assert len(events(stepped, "fault")) == 2


@pytest.mark.parametrize("mode", [*WITHOUT, *WITH_TORQUE])
def test_the_emergency_stop_stops_every_mode_in_its_cycle(stepped: Stepped, mode: Mode) -> None:
    bring(stepped, mode)
    stepped.apparatus.estop_open = True
    stepped.cycle()
    assert stepped.mode == "stopped"
    assert not stepped.torque
    for writer in stepped.link.journals:
        writer.write()
        assert stepped.journal().end is not None
    stepped.apparatus.estop_open = False
    stepped.cycle()
    assert stepped.send(Acknowledge()) is None
    stepped.cycle()
    assert stepped.mode == "idle"
    assert stepped.snapshot.stop is None
    assert stepped.snapshot.run is None
    assert stepped.snapshot.teaching is None


def test_ramp_that_does_not_settle_is_cut_at_double_time(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Movement, "at_rest", False)  # as an internal defect would
    playing.link.request_stop()
    playing.cycle()
    playing.forward(0.4)
    assert playing.torque
    playing.cycle()
    assert not playing.torque


def test_a_stop_that_is_still_ramping_down_is_not_acknowledged(playing: Stepped) -> None:
    playing.link.request_stop()
    playing.cycle()
    refusal = playing.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "still_stopping"
    playing.until("stopped")
    playing.forward(0.3)
    assert playing.send(Acknowledge()) is None


def test_jump_during_the_ramp_cuts_torque_early(playing: Stepped) -> None:
    playing.link.request_stop()
    playing.forward(0.05)
    assert playing.torque
    movement = playing.loop._machine._movement
    assert movement is not None
    movement.position_s += 0.5  # as an internal defect would
    playing.cycle()

    assert not playing.torque
    assert playing.causes() == ["operator_stop", "setpoint_step"]
    assert events(playing, "fault")[-1] == "The next setpoint of motor 4 would have caused a jump. (stop category 0)"
    playing.forward(0.05)
    end = playing.journal().end
    assert end is not None
    assert end.cause_code == "operator_stop"  # the first of them


def test_an_error_of_the_programs_own_ends_a_teaching_too(stepped: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    bring(stepped, "teaching")

    def broken(machine: state_machine.StateMachine, state: CycleState) -> None:
        raise RuntimeError("as if")

    monkeypatch.setitem(state_machine.StateMachine._STEPS, "teaching", broken)
    stepped.cycle()
    assert stepped.mode == "stopped"
    assert stepped.causes() == ["unexpected_error"]
    assert events(stepped, "fault") == ["The control program had an internal error. (stop category 0)"]
    assert stepped.snapshot.teaching is None
    assert stepped.journal().end is not None


@pytest.mark.counted
def test_error_stops_its_cycle_and_keeps_an_earlier_cause_first(
    playing: Stepped, monkeypatch: pytest.MonkeyPatch
) -> None:
    playing.link.request_stop()
    playing.cycle()
    stop = playing.snapshot.stop
    assert stop is not None
    playing.cycle()

    def broken(*_: object) -> None:
        raise RuntimeError("as if")

    monkeypatch.setattr(playing.loop._machine, "_follow_path", broken)
    playing.cycle()
    assert playing.causes() == ["operator_stop", "unexpected_error"]
    assert playing.snapshot.stop is not None
    assert playing.snapshot.stop.at_ns == stop.at_ns
    assert not playing.torque


def test_persistent_fault_stays_uncleared_when_the_program_fails(stepped: Stepped) -> None:
    bring(stepped, "paused")
    stepped.link.journal_ok = False
    stepped.cycle()
    machine = stepped.loop._machine
    state = stepped.loop._state_builder.build(stepped._t_ns, None, stepped.loop._loop_context(stepped._t_ns, 0.0))
    machine.abort(state, [("unexpected_error", None)])
    assert machine.stop is not None
    assert [(cause.code, cause.cleared) for cause in machine.stop.causes()] == [
        ("journal_fault", False),
        ("unexpected_error", True),
    ]


@pytest.mark.counted
def test_offline_errors_stop_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("as if")

    monkeypatch.setattr(state_machine.StateMachine, "_leave_offline", broken)
    stepped = Stepped(tmp_path)
    assert stepped.mode == "stopped"
    assert stepped.causes()[0] == "unexpected_error"


@pytest.mark.parametrize("code", ["drive_error", "estop_pressed"])
def test_apparatus_starts_only_with_at_most_the_estop_pressed(tmp_path: Path, code: str) -> None:
    apparatus = SteppedApparatus(estop_open=True)
    if code == "drive_error":
        apparatus.hardware_error[2] = 1
    stepped = Stepped(tmp_path, apparatus=apparatus)
    assert stepped.mode == ("offline" if code == "drive_error" else "stopped")


# -- the service ------------------------------------------------------------------------------------------------------


def test_two_disagreements_are_forgiven_by_a_heartbeat_that_agrees(playing: Stepped) -> None:
    for _ in range(10):
        playing.link.naming = "another"
        playing.forward(0.02)
        playing.link.naming = "run"
        playing.cycle()
    assert playing.causes() == []

    playing.link.naming = "another"
    playing.forward(0.03)
    assert playing.causes() == ["other_run"]


@pytest.mark.counted
@pytest.mark.parametrize(("mode", "occupied"), [("idle", ""), ("teaching", "t"), ("ready", "run"), ("playing", "run")])
def test_activity_has_the_name_that_the_service_gave(stepped: Stepped, mode: Mode, occupied: str) -> None:
    assert bring(stepped, mode).loop._machine.active_id == occupied


@pytest.mark.counted
@pytest.mark.parametrize(("mode", "reason"), [("ready", "unloaded"), ("teaching", "finished")])
def test_lost_service_ends_activities_without_torque_at_once(stepped: Stepped, mode: Mode, reason: str) -> None:
    bring(stepped, mode)
    stepped.link.closing = True
    assert not stepped.cycle()
    end = stepped.journal().end
    assert end is not None
    assert end.reason == reason


def test_shutdown_request_waits_until_torque_is_off(playing: Stepped) -> None:
    playing.link.closing = True  # and it still takes Stops
    assert playing.cycle()
    assert playing.torque
    playing.link.request_stop()
    for _ in range(30):
        if not playing.cycle():
            break
    assert not playing.torque


@pytest.mark.parametrize("mode", ["playing", "teaching", "ready"])
def test_a_sample_that_found_no_room_is_a_fault(stepped: Stepped, mode: Mode) -> None:
    bring(stepped, mode)
    assert stepped.loop._machine.journal_ok
    stepped.link.journals[-1].lost = 1
    assert not stepped.loop._machine.journal_ok
    stepped.cycle()
    assert stepped.causes() == ["journal_fault"]


def test_events_without_an_open_journal_are_not_lost(stepped: Stepped) -> None:
    assert stepped.loop._machine.journal_ok


# -- events and journals --------------------------------------------------------------------------------------------


def test_run_is_reported_from_load_to_end(stepped: Stepped) -> None:
    assert stepped.snapshot.run is None
    bring(stepped, "ready")
    run = stepped.snapshot.run
    assert run is not None
    assert (run.run_id, run.recording_id, run.resistance_level) == ("run", "recording", 25)
    assert (run.position_s, run.duration_s, run.left_s) == (0.0, 2.0, 2.0)
    assert (run.at_start, run.reversing, run.reversals) == (False, False, 0)

    stepped.send(Approach())
    stepped.forward(1.5)
    run = stepped.snapshot.run
    assert run is not None
    # 22 deg at 15 deg/s at most: 2.75 s of minimum jerk, a second back to the start, and a tenth for the ramp.
    assert run.left_s == pytest.approx(2.35, abs=0.11)
    assert not run.at_start
    stepped.until("paused")
    assert stepped.snapshot.run is not None
    assert stepped.snapshot.run.at_start
    assert stepped.snapshot.run.left_s == 2.0

    stepped.send(Play())
    stepped.forward(1.0)
    run = stepped.snapshot.run
    assert run is not None
    assert run.position_s == pytest.approx(0.9, abs=0.11)
    assert run.left_s == pytest.approx(2.0 - run.position_s)
    stepped.send(Pause())
    stepped.until("paused")
    assert stepped.snapshot.run is not None
    assert not stepped.snapshot.run.at_start
    stepped.send(Return())
    stepped.until("idle")
    assert stepped.snapshot.run is None


def test_finished_run_leaves_nothing_for_the_next_one(stepped: Stepped) -> None:
    bring(stepped, "playing")
    stepped.until("idle")
    assert stepped.send(LOAD, a_trajectory(4.0)) is None
    stepped.forward(0.1)
    run = stepped.snapshot.run
    assert run is not None
    assert (run.position_s, run.left_s, run.at_start) == (0.0, 4.0, False)


def test_after_unloading_nothing_is_left_of_the_run(stepped: Stepped) -> None:
    bring(stepped, "ready")
    assert stepped.send(Unload()) is None
    stepped.forward(0.1)
    assert stepped.snapshot.run is None
    assert stepped.loop._machine.active_id == ""
    bring(stepped, "playing")


def test_finished_teaching_leaves_no_state(stepped: Stepped) -> None:
    bring(stepped, "teaching")
    assert stepped.send(FinishTeaching()) is None
    stepped.forward(0.1)
    assert stepped.snapshot.teaching is None
    assert stepped.mode == "idle"
    end = stepped.journal().end
    assert end is not None
    assert end.reason == "finished"


def test_each_journal_names_its_contents(stepped: Stepped) -> None:
    bring(stepped, "teaching")
    stepped.send(FinishTeaching())
    bring(stepped, "ready")
    teaching, run = stepped.journal(0), stepped.journal(1)
    assert (teaching.kind, teaching.id, teaching.recording_id) == ("teaching", "t", None)
    assert (run.kind, run.id, run.recording_id) == ("run", "run", "recording")
    assert run.rate_hz == 100


def test_setpoint_follows_the_arm_until_torque_is_on(stepped: Stepped) -> None:
    for mode in ("idle", "ready"):
        bring(stepped, mode)
        stepped.apparatus.angles_deg[3] += 5.0
        stepped.cycle()
        assert stepped.loop._machine.setpoint_deg == tuple(stepped.apparatus.angles_deg)


@pytest.mark.parametrize("rate_hz", [10, 50, 100])
def test_first_setpoint_of_a_movement_comes_one_period_after_torque(tmp_path: Path, rate_hz: int) -> None:
    stepped = Stepped(tmp_path, StationConfig(rate_hz=rate_hz))
    bring(stepped, "ready")
    assert stepped.send(Approach()) is None
    sent = []
    for _ in range(3 * 100 // rate_hz):
        sent.append(len(stepped.apparatus.written))
        stepped.cycle()
    # The angle to hold is sent with torque on.
    assert sent == [1 + cycle // (100 // rate_hz) for cycle in range(3 * 100 // rate_hz)]


@pytest.mark.parametrize(("protocol", "delay_s"), [("dynamixel", 0.0), ("modbus", 0.01)])
@pytest.mark.parametrize("rate_hz", [10, 100])
def test_setpoint_aims_at_the_middle_of_its_hold_time(
    tmp_path: Path, rate_hz: int, protocol: Literal["dynamixel", "modbus"], delay_s: float
) -> None:
    """With Modbus the next cycle's request carries it."""
    stepped = Stepped(tmp_path, StationConfig(rate_hz=rate_hz, protocol=protocol))
    bring(stepped, "playing")
    machine = stepped.loop._machine
    trajectory = a_trajectory()
    for _ in range(20):
        stepped.cycle()
        if machine.setpoint_due:
            run = machine._run
            assert run is not None
            # At full speed: the place has advanced by one cycle since the setpoint was computed.
            aimed = trajectory.at(run.position_s - 0.01 + 0.5 / rate_hz + delay_s)
            assert machine.setpoint_deg == pytest.approx(tuple(aimed), abs=1e-6)


@pytest.mark.counted
def test_cycle_without_all_five_angles_is_no_sample_of_runs(playing: Stepped) -> None:
    playing.apparatus.silent = {3}
    playing.cycle()
    playing.apparatus.silent = set()
    playing.forward(0.1)
    recorded = playing.journal()
    assert sorted(np.diff(recorded.t_ns))[-2:] == [10_000_000, 20_000_000]


def test_path_time_is_recorded_only_on_the_recording(stepped: Stepped) -> None:
    bring(stepped, "playing")
    stepped.until("idle")
    recorded = stepped.journal()
    on_recording = np.isin(recorded.phase, (2, 3))
    assert np.all(np.isfinite(recorded.path_s[on_recording]))
    assert np.all(np.isnan(recorded.path_s[~on_recording]))
    assert set(recorded.phase) == {1, 2, 3, 4}
    assert set(recorded.take) == {0}


def test_each_sample_has_the_setpoint_it_answers(stepped: Stepped) -> None:
    """The drives in this test follow at once: a setpoint of one cycle is measured in the next."""
    bring(stepped, "playing")
    recorded = stepped.journal()
    assert recorded.measured_deg[5:] == pytest.approx(recorded.setpoint_deg[5:])


@pytest.mark.parametrize(("at_ms", "place_s"), [(0, 0.0), (-4, -0.004), (3, 0.003)])
def test_place_in_the_recording_matches_the_time_of_measurement(playing: Stepped, at_ms: int, place_s: float) -> None:
    """The angles arrived a little before or after the cycle's own time."""
    run = playing.loop._machine._run
    assert run is not None
    position_s = run.position_s
    read = playing.apparatus.read

    def shifted() -> object:
        playing.apparatus.t_ns += at_ms * 1_000_000
        return read()

    playing.apparatus.read = shifted  # type: ignore[assignment, method-assign]
    playing.cycle()
    recorded = playing.journal()
    assert recorded.path_s[-1] == pytest.approx(position_s + place_s, abs=1e-6)
