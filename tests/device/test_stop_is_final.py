"""A stop is final: defects that an outside review reproduced on the real loop, each with the test that failed first."""

from pathlib import Path

import msgspec
import pytest

from kata.device.config import Inputs, StationConfig
from kata.device.ipc_messages import Acknowledge, Approach, Command, Pause, Play, ReleaseTorque, Return, Stop, stamped
from tests.support.stepped import NEVER_NS, Stepped, SteppedApparatus
from tests.support.trajectories import LOAD, a_trajectory


def ready(stepped: Stepped) -> Stepped:
    """Return an apparatus with a loaded recording."""
    assert stepped.send(LOAD, a_trajectory()) is None
    return stepped


def reconnect(stepped: Stepped, seconds: float = 1.0) -> None:
    """Plug the adapter in again and let the loop open the port."""
    stepped.apparatus.gone = False
    stepped.loop._try_open_at_ns = 0
    stepped.loop._open()
    stepped.forward(seconds)


def torque_shown(stepped: Stepped) -> list[str]:
    return [axis.torque for axis in stepped.snapshot.axes]


# -- a Stop and the commands around it --------------------------------------------------------------------------------


def test_a_stop_discards_an_approach_that_waits(stepped: Stepped) -> None:
    """[Approach, Stop] in one cycle ended in ``approaching``."""
    ready(stepped)
    stops = stepped.snapshot.stops
    stepped.link.request(7, stamped(Approach(), stops, NEVER_NS), stepped.config)
    stepped.link.request_stop()
    stepped.forward(0.2)
    assert stepped.mode == "stopped"
    assert not stepped.torque
    assert [(reply.id, reply.refusal and reply.refusal.code) for reply in stepped.link.replies][-1] == (
        7,
        "stopped_meanwhile",
    )


@pytest.mark.parametrize("command", [Approach(), Play(), Return(), ReleaseTorque(), Acknowledge()])
def test_a_command_from_before_a_stop_is_refused(stepped: Stepped, command: Command) -> None:
    """A Stop overtook an Approach that waited for the database: the Approach was carried out."""
    ready(stepped)
    delayed = stamped(command, stepped.snapshot.stops, NEVER_NS)
    stepped.link.request_stop()
    stepped.cycle()
    stepped.link.request(7, delayed, stepped.config)
    stepped.forward(0.2)
    refusal = stepped.link.replies[-1].refusal
    assert refusal is not None
    assert refusal.code == "stopped_meanwhile"
    assert stepped.mode == "stopped"


@pytest.mark.parametrize("mode", ["ready", "paused"])
def test_a_start_from_before_a_refused_pause_is_refused(stepped: Stepped, mode: str) -> None:
    """A Play was delayed, and the Pause after it came first and was refused. The arm started after the Pause."""
    ready(stepped)
    command: Command = Approach()
    if mode == "paused":
        assert stepped.send(Approach()) is None
        stepped.until("paused")
        command = Play()
    delayed = stamped(command, stepped.snapshot.stops, NEVER_NS)
    assert stepped.send(Pause()) is not None
    stepped.link.request(7, delayed, stepped.config)
    stepped.forward(0.2)
    refusal = stepped.link.replies[-1].refusal
    assert refusal is not None
    assert refusal.code == "stopped_meanwhile"
    assert stepped.mode == mode
    assert stepped.send(command) is None


def test_a_command_from_before_a_fault_is_refused(stepped: Stepped) -> None:
    ready(stepped)
    delayed = stamped(Approach(), stepped.snapshot.stops, NEVER_NS)
    stepped.apparatus.estop_open = True
    stepped.forward(0.1)
    stepped.apparatus.estop_open = False
    stepped.forward(0.1)
    assert stepped.send(Acknowledge()) is None
    ready(stepped)
    stepped.link.request(7, delayed, stepped.config)
    stepped.forward(0.1)
    assert stepped.mode == "ready"


@pytest.mark.counted
def test_an_expired_command_is_refused(stepped: Stepped) -> None:
    ready(stepped)
    now_ns = stepped.snapshot.t_ns
    for expires_ns, code in ((now_ns - 1, "expired"), (now_ns + 10**9, None)):
        refusal = stepped.send_as_it_is(stamped(Approach(), stepped.snapshot.stops, expires_ns))
        assert (refusal and refusal.code) == code


def test_a_command_without_counter_and_expiry_is_refused(stepped: Stepped) -> None:
    ready(stepped)
    refusal = stepped.send_as_it_is(Approach())
    assert refusal is not None
    assert stepped.mode == "ready"


def test_each_stop_counts(stepped: Stepped) -> None:
    counts = [stepped.snapshot.stops]
    for _ in range(2):
        ready(stepped)
        stepped.link.request_stop()
        stepped.forward(0.1)
        counts.append(stepped.snapshot.stops)
        assert stepped.send(Acknowledge()) is None
    # The load, the command and the stop that it latched.
    assert [count - counts[0] for count in counts] == [0, 3, 6]


# -- the known torque state ----------------------------------------------------------------------------------------


def test_torque_is_unknown_while_the_port_is_lost(playing: Stepped) -> None:
    """All five drives held torque, and the snapshot said off."""
    assert torque_shown(playing) == ["on"] * 5
    playing.apparatus.gone = True
    playing.forward(0.2)
    assert playing.torque
    assert playing.snapshot.torque == "unknown"
    assert torque_shown(playing) == ["unknown"] * 5
    stop = playing.snapshot.stop
    assert stop is not None
    assert "Support the arm" in stop.causes[0].next_step


@pytest.mark.counted
def test_reconnected_arm_is_held_until_released(playing: Stepped) -> None:
    """On reconnecting the arm dropped unannounced."""
    playing.apparatus.gone = True
    playing.forward(0.2)
    refusal = playing.send(ReleaseTorque())
    assert refusal is not None
    assert refusal.code == "is_offline"
    reconnect(playing)
    assert playing.torque
    assert playing.snapshot.torque == "on"
    assert playing.causes() == ["bus_lost"] + ["torque_found"] * 5
    refusal = playing.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "torque_found"

    assert playing.send(ReleaseTorque()) is None
    assert playing.link.events[-1].message == "Torque is released: the arm is supported."
    playing.forward(0.3)
    assert not playing.torque
    assert playing.snapshot.torque == "off"
    assert "torque_remains" not in playing.causes()
    assert playing.send(ReleaseTorque()) is not None
    assert playing.send(Acknowledge()) is None
    assert playing.mode == "idle"


def test_the_emergency_stop_releases_a_found_arm(playing: Stepped) -> None:
    playing.apparatus.gone = True
    playing.forward(0.2)
    reconnect(playing)
    playing.apparatus.estop_open = True
    playing.cycle()
    assert not playing.torque
    playing.forward(0.3)
    assert "torque_remains" not in playing.causes()


def test_found_arm_that_cannot_be_released_is_named(playing: Stepped) -> None:
    playing.apparatus.gone = True
    playing.forward(0.2)
    reconnect(playing)
    playing.apparatus.deaf_to_torque_off = {2}
    assert playing.send(ReleaseTorque()) is None
    playing.forward(0.3)
    assert playing.causes().count("torque_remains") == 1


def test_new_process_holds_the_arm_that_it_finds(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(torque=[True] * 5))
    assert stepped.torque
    assert stepped.mode == "stopped"
    assert stepped.causes()[0] == "torque_found"
    assert stepped.loop._link is stepped.link
    stepped.link.closing = True
    stepped.loop._torque_off_on_exit()
    assert stepped.torque


def test_found_arm_waits_for_a_drive_until_it_is_silent(tmp_path: Path) -> None:
    """The stop names every other drive that holds the arm."""
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(torque=[True] * 5), settle=False)
    stepped.apparatus.silent = {4}
    stepped.forward(stepped.config.silence_ms / 1000)
    assert stepped.mode == "offline"
    stepped.cycle()
    assert stepped.mode == "stopped"
    assert stepped.snapshot.stop is not None
    found = [cause.axis for cause in stepped.snapshot.stop.causes if cause.code == "torque_found"]
    assert found == [1, 2, 3, 4]


def test_torque_is_off_when_every_drive_confirms_it(playing: Stepped) -> None:
    playing.apparatus.deaf_to_torque_off = {2}
    playing.apparatus.estop_open = True
    playing.cycle()
    assert torque_shown(playing) == ["on"] * 5
    playing.forward(0.3)
    assert torque_shown(playing) == ["off", "off", "on", "off", "off"]
    assert playing.snapshot.torque == "on"


def test_a_silent_drives_torque_is_unknown(playing: Stepped) -> None:
    playing.apparatus.silent = {1}
    playing.apparatus.deaf_to_torque_off = {1}
    playing.forward(1.5)
    assert torque_shown(playing) == ["off", "unknown", "off", "off", "off"]
    assert playing.snapshot.torque == "unknown"


@pytest.mark.counted
def test_torque_is_unknown_at_first(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(silent={0}))
    assert stepped.snapshot.torque == "unknown"


# -- drives that lose their settings --------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["idle", "playing"])
def test_a_lost_setting_stops_and_is_mended(stepped: Stepped, mode: str) -> None:
    if mode == "playing":
        ready(stepped)
        stepped.send(Approach())
        stepped.until("paused")
        stepped.send(Play())
    stepped.apparatus.mismatch[4] = "position gains"
    stepped.forward(0.06)
    assert stepped.mode == "stopped"
    assert stepped.causes() == ["drive_reset"]
    stepped.forward(0.5)
    assert not stepped.torque
    assert stepped.apparatus.configured == [4]
    assert stepped.send(Acknowledge()) is None


def test_stop_lasts_until_the_drive_is_verified_again(stepped: Stepped) -> None:
    stepped.apparatus.refuses_configuration = "motor 5 (id 5) is model 1030; the station's file requires 1120"
    stepped.apparatus.mismatch[4] = "model number"
    stepped.forward(1.0)
    refusal = stepped.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "drive_reset"
    stepped.apparatus.refuses_configuration = ""
    stepped.apparatus.verified[4] = False
    stepped.apparatus.mismatch[4] = ""
    stepped.forward(0.3)
    refusal = stepped.send(Acknowledge())
    assert refusal is not None
    stepped.apparatus.verified[4] = True
    stepped.forward(0.1)
    assert stepped.send(Acknowledge()) is None


@pytest.mark.counted
def test_an_unverified_drive_cannot_be_acknowledged(playing: Stepped) -> None:
    """A drive that reconnects is read again before the stop can be acknowledged."""
    playing.link.request_stop()
    playing.forward(0.5)
    playing.apparatus.verified[1] = False
    playing.forward(0.1)
    refusal = playing.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "not_verified"
    assert "being checked" in refusal.message
    playing.loop._machine.drive_problem = "motor 2 (id 2) does not accept its position gains"
    refusal = playing.send(Acknowledge())
    assert refusal is not None
    assert "motor 2 (id 2) does not accept its position gains" in refusal.message


def test_drives_with_torque_are_never_configured(playing: Stepped) -> None:
    playing.apparatus.deaf_to_torque_off = {0}
    playing.apparatus.mismatch[4] = "position gains"
    playing.forward(0.5)
    assert playing.apparatus.configured == []
    playing.apparatus.deaf_to_torque_off = set()
    playing.forward(0.5)
    assert playing.apparatus.configured == [4]


def test_inputs_of_a_held_arm_are_configured(playing: Stepped) -> None:
    """An exchanged inputs' drive left the emergency stop unread until the therapist released the arm."""
    playing.apparatus.gone = True
    playing.forward(0.2)
    playing.apparatus.torque[0] = playing.apparatus.torque[1] = False
    playing.apparatus.mismatch[0] = playing.apparatus.mismatch[1] = "mode of external port 1"
    playing.apparatus.mismatch[4] = "position gains"
    reconnect(playing)
    assert playing.apparatus.configured == [0]
    assert playing.apparatus.torque == [False, False, True, True, True]
    playing.apparatus.estop_open = True
    playing.forward(1.0)
    assert not any(playing.apparatus.torque)
    assert sorted(playing.apparatus.configured) == [0, 1, 4]


def test_inputs_of_a_drive_that_holds_are_not_configured(playing: Stepped) -> None:
    playing.apparatus.gone = True
    playing.forward(0.2)
    playing.apparatus.mismatch[0] = "mode of external port 1"
    reconnect(playing)
    assert playing.apparatus.configured == []


def test_a_reset_or_a_reconnect_ends_the_verified_time(stepped: Stepped) -> None:
    """Today's emergency stop test counts only from then on."""
    first = stepped.snapshot.verified_since_ns
    assert first is not None
    stepped.apparatus.mismatch[0] = "mode of external port 1"
    stepped.forward(0.06)
    assert stepped.snapshot.verified_since_ns is None
    stepped.forward(1.0)
    second = stepped.snapshot.verified_since_ns
    assert second is not None
    assert second > first
    stepped.apparatus.gone = True
    stepped.forward(0.2)
    assert stepped.snapshot.verified_since_ns is None
    reconnect(stepped)
    third = stepped.snapshot.verified_since_ns
    assert third is not None
    assert third > second


def test_offline_is_left_with_every_drive_verified(tmp_path: Path) -> None:
    apparatus = SteppedApparatus(verified=[True, True, False, True, True])
    stepped = Stepped(tmp_path, apparatus=apparatus)
    assert stepped.mode == "offline"
    apparatus.verified[2] = True
    stepped.forward(0.1)
    assert stepped.mode == "idle"


def test_an_offline_apparatus_names_its_problem(tmp_path: Path) -> None:
    problem = "motor 3 (id 3) is model 1030; the station's file requires 1120"
    apparatus = SteppedApparatus(mismatch=["", "", "model number", "", ""], refuses_configuration=problem)
    stepped = Stepped(tmp_path, apparatus=apparatus)
    stepped.forward(0.5)
    assert problem in stepped.snapshot.refusals["load"].message
    apparatus.silent = {4}
    stepped.forward(0.5)
    assert "motor 5 (id 5) does not answer" in stepped.snapshot.refusals["load"].message


# -- the emergency stop's contacts and alerts ------------------------------------------------------------------------------


def test_equal_contacts_stop_after_the_stated_time(tmp_path: Path) -> None:
    """A drive exchanged for a factory-default one read "closed" with the switch pressed."""
    config = msgspec.structs.replace(StationConfig(), inputs=Inputs(estop_second_port=3, contacts_disagree_ms=100))
    stepped = Stepped(tmp_path, config)
    stepped.apparatus.contacts_disagree = True
    stepped.forward(0.1)
    assert stepped.mode == "idle"
    stepped.forward(0.05)
    assert stepped.causes() == ["contacts_disagree"]
    refusal = stepped.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "contacts_disagree"
    stepped.apparatus.contacts_disagree = False
    stepped.forward(0.1)
    assert stepped.send(Acknowledge()) is None


@pytest.mark.counted
def test_contacts_that_disagree_at_first_stop(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path, apparatus=SteppedApparatus(contacts_disagree=True))
    assert stepped.causes() == ["contacts_disagree"]


def test_an_alert_stops_in_the_same_cycle(playing: Stepped) -> None:
    """The alert bit was dropped: a hardware error was seen up to five cycles late."""
    playing.apparatus.alert[3] = True
    playing.cycle()
    assert playing.causes() == ["drive_error"]
    assert not playing.torque


def test_a_stop_message_has_no_expiry() -> None:
    assert stamped(Stop(), 3, 5) == Stop()


def test_other_adapter_is_named_until_the_former_one_returns(playing: Stepped) -> None:
    playing.apparatus.gone = True
    playing.forward(0.2)
    playing.apparatus.gone, playing.apparatus.other_adapter = False, True
    playing.forward(0.3)
    playing.loop._open()
    playing.forward(0.1)
    assert playing.causes() == ["bus_lost", "other_adapter"]
    assert playing.snapshot.torque == "unknown"
    refusal = playing.send(Acknowledge())
    assert refusal is not None and refusal.code in ("bus_lost", "other_adapter")

    playing.apparatus.other_adapter = False
    reconnect(playing)
    stop = playing.snapshot.stop
    assert stop is not None
    assert {cause.code: cause.cleared for cause in stop.causes if cause.axis is None} == {
        "bus_lost": True,
        "other_adapter": True,
    }
    assert playing.torque, "the arm is held until a person releases it"
