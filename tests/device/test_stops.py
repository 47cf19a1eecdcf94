"""Stops with a stepped clock: every row of the fault table, and the steps to resume."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kata.device import journal
from kata.device.faults import FAULT_BY_CODE, FAULTS
from kata.device.ipc_messages import Acknowledge, Approach, Play
from tests.support.stepped import Stepped, SteppedApparatus
from tests.support.trajectories import LOAD, a_trajectory


def test_emergency_stop_cuts_torque_in_the_cycle_that_reads_it(playing: Stepped) -> None:
    playing.apparatus.estop_open = True
    playing.cycle()

    assert not playing.torque
    assert playing.mode == "stopped"
    assert playing.estop == "pressed"
    assert playing.causes() == ["estop_pressed"]


def test_the_emergency_stop_is_looked_at_between_two_cycles_too(playing: Stepped) -> None:
    playing.apparatus.estop_open = True
    playing.loop.poll_estop()
    assert not playing.torque

    # Even the shortest press that was detected stops.
    playing.apparatus.estop_open = False
    playing.cycle()
    assert playing.mode == "stopped"
    assert playing.causes() == ["estop_pressed"]
    playing.forward(1.0)
    assert not playing.torque


def test_between_two_cycles_nothing_else_is_done(playing: Stepped) -> None:
    playing.loop.poll_estop()
    playing.apparatus.inputs_silent = True
    playing.loop.poll_estop()
    assert playing.torque
    playing.apparatus.inputs_silent = False
    playing.cycle()
    assert playing.mode == "playing"


def test_port_lost_between_two_cycles_is_noticed_in_the_next(playing: Stepped) -> None:
    playing.apparatus.gone = True
    playing.loop.poll_estop()
    playing.cycle()
    assert playing.causes() == ["bus_lost"]


def test_release_alone_starts_nothing_and_acknowledgement_alone_starts_nothing(playing: Stepped) -> None:
    playing.apparatus.estop_open = True
    playing.forward(0.2)
    refusal = playing.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "estop_pressed"
    assert "Release the switch" in refusal.next_step

    playing.apparatus.estop_open = False
    playing.forward(5.0)
    assert playing.mode == "stopped"
    assert playing.estop == "released"
    assert not playing.torque
    refusal = playing.send(Play())
    assert refusal is not None
    assert refusal.code == "is_stopped"

    assert playing.send(Acknowledge()) is None
    playing.forward(5.0)
    assert playing.mode == "idle"
    assert playing.estop == "closed"
    assert not playing.torque

    # A new start has all steps: load, approach, play.
    assert playing.send(LOAD, a_trajectory()) is None
    assert playing.send(Approach()) is None
    playing.until("paused")
    assert playing.send(Play()) is None
    playing.until("idle")


@pytest.mark.counted
def test_an_emergency_stop_found_pressed_at_start_is_a_stop(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(estop_open=True))

    assert stepped.mode == "stopped"
    assert stepped.causes() == ["estop_pressed"]


def test_nothing_is_idle_before_every_drive_has_been_seen(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(silent={4}))
    assert stepped.mode == "offline"
    assert stepped.snapshot.axes[4].measured_deg is None

    stepped.apparatus.silent = set()
    stepped.forward(0.2)
    assert stepped.mode == "idle"


def test_nothing_is_idle_before_the_emergency_stop_has_been_seen(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(inputs_silent=True))
    assert stepped.mode == "offline"
    assert stepped.estop == "unknown"

    stepped.apparatus.inputs_silent = False
    stepped.forward(0.2)
    assert stepped.mode == "idle"


def test_stopped_run_records_its_cause_in_its_journal(playing: Stepped) -> None:
    playing.apparatus.estop_open = True
    playing.forward(0.1)

    end = playing.journal().end
    assert end is not None
    assert (end.reason, end.cause_code) == ("stopped", "estop_pressed")


def test_operators_stop_ramps_along_the_path_and_then_cuts_torque(playing: Stepped) -> None:
    playing.link.request_stop()
    playing.cycle()
    assert playing.mode == "stopped"
    assert playing.torque

    playing.forward(0.3)
    assert not playing.torque
    assert playing.causes() == ["operator_stop"]
    recorded = playing.journal()
    stopping = recorded.path_s[recorded.phase == journal.PHASE_STOPPING]
    assert np.all(np.diff(stopping) >= 0)
    assert np.diff(stopping)[-1] < np.diff(stopping)[0]


def test_emergency_stop_during_the_ramp_cuts_it_short(playing: Stepped) -> None:
    playing.link.request_stop()
    playing.forward(0.05)
    playing.apparatus.estop_open = True
    playing.cycle()

    assert not playing.torque
    assert playing.causes() == ["operator_stop", "estop_pressed"]


def test_stop_with_nothing_active_is_accepted_and_latches_nothing(stepped: Stepped) -> None:
    stepped.link.request_stop()
    stepped.forward(0.1)
    assert stepped.mode == "idle"


def _press(stepped: Stepped) -> None:
    stepped.apparatus.estop_open = True


def _lose_inputs(stepped: Stepped) -> None:
    stepped.apparatus.inputs_silent = True


def _unplug(stepped: Stepped) -> None:
    stepped.apparatus.gone = True


def _silence(stepped: Stepped) -> None:
    stepped.apparatus.silent = {2}


def _overheat(stepped: Stepped) -> None:
    stepped.apparatus.hardware_error[1] = 4


def _trip(stepped: Stepped) -> None:
    stepped.apparatus.watchdog_tripped = True


def _switch_itself_off(stepped: Stepped) -> None:
    stepped.apparatus.torque[4] = False


def _push_out(stepped: Stepped) -> None:
    stepped.apparatus.drift_deg_s[0] = 100.0


def _hold(stepped: Stepped) -> None:
    stepped.apparatus.drift_deg_s[2] = 100.0


def _jump(stepped: Stepped) -> None:
    stepped.apparatus.stuck = {2}
    stepped.apparatus.angles_deg[2] = 60.0


def _freeze(stepped: Stepped) -> None:
    stepped.apparatus.stuck = {3}


def _strain(stepped: Stepped) -> None:
    stepped.apparatus.torques_nm[1] = -5.0


def _garble(stepped: Stepped) -> None:
    stepped.apparatus.corrupt = {3}


def _mean_another_run(stepped: Stepped) -> None:
    stepped.link.naming = "another"


def _stop_planning(stepped: Stepped) -> None:
    run = stepped.loop._machine._run
    assert run is not None
    run.cycles_per_setpoint = 1_000_000


def _run_away(stepped: Stepped) -> None:
    stepped.apparatus.speeds_deg_s[0] = 250.0


def _silence_service(stepped: Stepped) -> None:
    stepped.link.service_silent_ms = 600.0


def _fill_disk(stepped: Stepped) -> None:
    stepped.link.journal_ok = False


@pytest.mark.parametrize(
    ("code", "happen"),
    [
        ("estop_pressed", _press),
        ("estop_unknown", _lose_inputs),
        ("bus_lost", _unplug),
        ("drive_silent", _silence),
        ("drive_error", _overheat),
        ("drive_watchdog", _trip),
        ("torque_lost", _switch_itself_off),
        ("position_limit", _push_out),
        ("following_error", _hold),
        ("overspeed", _run_away),
        ("position_jump", _jump),
        ("position_frozen", _freeze),
        ("overtorque", _strain),
        ("drive_garbled", _garble),
        ("other_run", _mean_another_run),
        ("setpoint_frozen", _stop_planning),
        ("service_silent", _silence_service),
        ("journal_fault", _fill_disk),
    ],
)
def test_each_fault_stops_by_its_category_and_names_itself(
    playing: Stepped, code: str, happen: Callable[[Stepped], None]
) -> None:
    happen(playing)
    playing.until("stopped", within_s=0.6)
    assert playing.causes()[0] == code
    torque_commanded = playing.loop._machine.torque_on
    assert torque_commanded == (FAULT_BY_CODE[code].category == 1)

    playing.forward(0.3)
    assert not playing.loop._machine.torque_on
    if code != "bus_lost":  # no drive can be reached then; its own watchdog stops it
        assert not playing.torque


def test_a_late_loop_stops_the_movement(playing: Stepped) -> None:
    playing.cycle(late_ms=300.0)
    assert playing.causes() == ["overrun"]


def test_torque_that_stays_on_is_cut_every_cycle_and_reported(playing: Stepped) -> None:
    playing.apparatus.deaf_to_torque_off = {3}
    playing.apparatus.estop_open = True
    playing.forward(0.5)
    assert "torque_remains" in playing.causes()
    assert playing.snapshot.torque == "on"
    assert [axis.torque for axis in playing.snapshot.axes] == ["off", "off", "off", "on", "off"]

    playing.apparatus.deaf_to_torque_off = set()
    playing.forward(0.1)
    assert not playing.torque


def test_an_error_in_the_control_program_stops_at_once(playing: Stepped, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("as if")

    monkeypatch.setattr(playing.loop._machine, "_follow_path", broken)
    playing.cycle()
    assert not playing.torque
    assert playing.mode == "stopped"
    assert playing.causes() == ["unexpected_error"]


@pytest.mark.counted
def test_a_jump_is_never_sent(playing: Stepped) -> None:
    movement = playing.loop._machine._movement
    assert movement is not None
    movement.position_s += 0.5  # as an internal defect would
    playing.cycle()

    assert not playing.torque
    assert playing.causes() == ["setpoint_step"]
    assert np.abs(np.diff(np.array(playing.apparatus.written), axis=0)).max() < 0.6


@pytest.mark.counted
def test_a_setpoint_that_is_no_number_is_never_sent(playing: Stepped) -> None:
    movement = playing.loop._machine._movement
    assert movement is not None
    movement.position_s = float("nan")
    playing.cycle()

    assert not playing.torque
    assert playing.mode == "stopped"
    assert np.all(np.isfinite(np.array(playing.apparatus.written)))


def test_a_silent_drive_without_torque_is_a_stop_too(stepped: Stepped) -> None:
    stepped.apparatus.silent = {0}
    stepped.forward(0.2)
    assert stepped.causes() == ["drive_silent"]
    refusal = stepped.send(Acknowledge())
    assert refusal is not None
    assert refusal.message == "Motor 1 does not answer."


@pytest.mark.counted
def test_lost_service_ends_a_playback_without_torque(playing: Stepped) -> None:
    playing.link.closing = True
    playing.link.service_silent_ms = float("inf")
    cycles = 0
    while playing.cycle():
        cycles += 1
        assert cycles < 50

    assert not playing.torque
    end = playing.journal().end
    assert end is not None
    assert (end.reason, end.cause_code) == ("stopped", "service_silent")


def test_the_table_reads_well() -> None:
    assert len(FAULT_BY_CODE) == len(FAULTS)
    for fault in FAULTS:
        assert fault.message.english.endswith(".")
        assert fault.next_step.english.endswith(".")
