"""The link between service and control thread: a Stop waits for nothing, and neither disk nor builder delays another
thread.
"""

import socket
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc import QueuedCommand, SocketServiceLink
from kata.device.ipc_messages import (
    LONGEST_LOAD_BYTES,
    Acknowledge,
    Approach,
    Command,
    Heartbeat,
    JournalClosed,
    Load,
    LoadPart,
    Pause,
    Refusal,
    Reply,
    Request,
    Snapshot,
    Stop,
    Teach,
    Unload,
    frame,
    frames,
    frames_of,
    parts_of,
)
from kata.device.journal import JournalDisk, JournalEnd, read
from kata.device.journal_set import JournalSet
from kata.device.loader import ReferenceLoader
from kata.device.refusals import not_in_this_mode
from tests.support.ipc_service import LIMIT_S, FakeLoader, Service, a_reference, until
from tests.support.journals import HEADER, give
from tests.support.load_messages import TIMES_S, angles, message
from tests.support.stepped import Stepped

SAMPLES_AN_HOUR = 360_000
UNPLAYABLE = Refusal(code="unplayable", message="This recording cannot be played: it is a test.", next_step="None.")


@contextmanager
def running(folder: Path, files: JournalDisk | None = None) -> Iterator[Service]:
    """Start the link with its threads."""
    service = Service(folder, files)
    service.link.start()
    try:
        yield service
    finally:
        service.link.finish()
        service.close()


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    """Return the link without threads: everything happens in order."""
    made = Service(tmp_path)
    yield made
    made.close()


@pytest.fixture
def snapshot(tmp_path: Path) -> Snapshot:
    return Stepped(tmp_path).snapshot


def an_hour() -> Load:
    times = np.arange(SAMPLES_AN_HOUR) / 100
    angles_deg = np.tile(angles()[0], (SAMPLES_AN_HOUR, 1))
    return Load(run_id="r", recording_id="a", times_s=times.tobytes(), angles_deg=angles_deg.tobytes())


# -- the disk -----------------------------------------------------------------------------------------------------


def test_samples_are_written_and_stops_heard_while_disk_is_busy(tmp_path: Path) -> None:
    busy, may_end = threading.Event(), threading.Event()

    class SlowSync(JournalDisk):
        def sync(self, file: int) -> None:
            busy.set()
            assert may_end.wait(LIMIT_S)

    with running(tmp_path, SlowSync()) as service:
        link = service.link
        writer = link.open_journal(HEADER)
        link.wake()
        assert busy.wait(LIMIT_S)

        for n in range(3):
            give(writer, n * 10_000_000)
            link.wake()
        service.ask(1, Stop(because="browser_lost"))
        until(lambda: writer.path.exists() and len(read(writer.path).t_ns) == 3)
        assert service.hear() == Reply(id=1)
        assert link.take_stop() == "browser_lost"
        assert link.take_stop() is None
        assert not may_end.is_set()

        writer.finish(JournalEnd(reason="completed"))
        may_end.set()
        link.wake()
        assert service.hear() == JournalClosed(path=str(writer.path))
        assert read(writer.path).end is not None
        assert link.journal_ok


def test_a_slow_write_of_the_journal_does_not_delay_stop(tmp_path: Path) -> None:
    busy, may_end = threading.Event(), threading.Event()

    class SlowWrite(JournalDisk):
        def write(self, file: int, data: bytearray) -> int:
            busy.set()
            assert may_end.wait(LIMIT_S)
            return super().write(file, data)

    with running(tmp_path, SlowWrite()) as service:
        writer = service.link.open_journal(HEADER)
        service.link.wake()
        assert busy.wait(LIMIT_S)
        service.ask(1, Stop())
        assert service.hear() == Reply(id=1)
        assert service.link.take_stop() == "operator_stop"
        give(writer, 0)
        writer.finish(JournalEnd(reason="stopped"))
        may_end.set()
    recorded = read(writer.path)
    assert (len(recorded.t_ns), recorded.truncated) == (1, False)
    assert recorded.end is not None


def test_journal_is_on_disk_when_the_process_ends_unannounced(tmp_path: Path) -> None:
    service, device = socket.socketpair()
    with device:
        link = SocketServiceLink(StationConfig(), device, JournalSet(tmp_path), FakeLoader())
        link.start()
        service.close()
        until(lambda: link.closing)
        writer = link.open_journal(HEADER)
        give(writer, 0)
        writer.finish(JournalEnd(reason="completed"))
        link.finish()
        recorded = read(writer.path)
    assert (len(recorded.t_ns), recorded.truncated) == (1, False)
    assert recorded.end is not None


def test_last_messages_reach_the_service(tmp_path: Path) -> None:
    service = Service(tmp_path)
    service.link.start()
    writer = service.link.open_journal(HEADER)
    writer.finish(JournalEnd(reason="unloaded"))
    service.link.reply(Reply(id=9))
    service.link.finish()
    heard = [service.hear(), service.hear()]
    service.close()
    assert JournalClosed(path=str(writer.path)) in heard
    assert Reply(id=9) in heard


# -- stop ---------------------------------------------------------------------------------------------------------


def test_a_stop_behind_an_hours_load_is_answered_at_once(tmp_path: Path) -> None:
    """The builder never answers."""
    with running(tmp_path) as service:
        service.ask(1, an_hour())
        service.ask(2, Stop())
        load, stop = service.hear(), service.hear()
        assert (load.id, load.refusal.code) == (1, "stopped_meanwhile")
        assert stop == Reply(id=2)
        assert service.link.take_stop() == "operator_stop"


def test_stop_and_heartbeat_go_between_the_parts_of_a_load(service: Service) -> None:
    first, second, *_ = frames_of(Request(id=1, command=an_hour()))
    incoming = bytearray()
    for part in (first, frame(Heartbeat(run_id="")), frame(Request(id=2, command=Stop())), second):
        incoming += part
        service._socket.sendall(part)
    service.link._receive(bytearray())
    assert service.link.heartbeats == (1, "")
    assert service.answers() == [(1, "stopped_meanwhile"), (2, None)]
    assert max(len(part) for part in frames_of(Request(id=1, command=an_hour()))) < 70_000


def test_a_stop_discards_every_queued_command(service: Service) -> None:
    commands: tuple[Command, ...] = (Approach(), Pause(), Acknowledge())
    for number, command in enumerate(commands, start=1):
        service.deliver(number, command)
    service.deliver(4, Stop())
    assert service.link.take_command() is None
    discarded = [(number, "stopped_meanwhile") for number in (1, 2, 3)]
    assert service.answers() == [*discarded, (4, None)]
    assert service.link.take_stop() == "operator_stop"
    assert service.link.take_command() is None


def test_stops_are_counted_and_the_first_reason_stays(service: Service) -> None:
    service.deliver(1, Stop(because="browser_lost"))
    service.deliver(2, Stop())
    assert service.link.stop_requests == 2
    assert service.link.take_stop() == "browser_lost"
    assert service.link.take_stop() is None


def test_command_behind_an_untaken_stop_waits_for_it(service: Service) -> None:
    service.deliver(1, Stop())
    service.deliver(2, Approach())
    service.deliver(3, Pause())
    assert service.link.take_command() is None
    assert service.link.take_stop() == "operator_stop"
    taken = [service.link.take_command(), service.link.take_command()]
    assert [command and command.id for command in taken] == [2, 3]


class StopInBetween(deque[QueuedCommand]):
    """Inserts a Stop between two instructions of the control thread."""

    def __init__(self, service: Service) -> None:
        super().__init__()
        self._service = service
        self._come = False

    def popleft(self) -> QueuedCommand:
        taken = super().popleft()
        if not self._come:
            self._come = True
            self._service.deliver(9, Stop())
        return taken


def test_stop_during_a_command_discards_it(service: Service) -> None:
    service.link._commands = StopInBetween(service)
    service.deliver(1, Approach())
    assert service.link.take_stop() is None
    assert service.link.take_command() is None
    assert sorted(service.answers()) == [(1, "stopped_meanwhile"), (9, None)]
    assert service.link.take_stop() == "operator_stop"
    assert service.link.take_command() is None


def test_stop_during_another_stop_is_not_lost(service: Service) -> None:
    """The Stop may come between any two instructions."""

    class Stops(deque[Any]):
        def popleft(self) -> Any:
            taken = super().popleft()
            if service.link.stop_requests == 1:
                service.deliver(2, Stop())
            return taken

    service.link._stops = Stops()
    service.deliver(1, Stop())
    assert service.link.take_stop() == "operator_stop"
    assert service.link.stop_requests == 2
    service.deliver(3, Approach())
    assert service.link.take_command() is not None


# -- loading ------------------------------------------------------------------------------------------------------


def test_a_checked_load_is_handed_on_without_its_samples(service: Service) -> None:
    service.deliver(1, message())
    assert service.link.take_command() is None
    built = a_reference()
    service.loader.answer(1, built)
    service.link._take_load_results()
    taken = service.link.take_command()
    assert taken is not None
    assert isinstance(taken.command, Load)
    assert (taken.id, taken.trajectory, taken.command.times_s) == (1, built.trajectory, b"")
    sent = b"".join(part.data for part in service.loader.sent if isinstance(part, LoadPart))
    assert sent == message().times_s + message().angles_deg


def test_recording_refused_by_the_builder_is_refused(service: Service) -> None:
    service.deliver(1, message())
    service.loader.answer(1, UNPLAYABLE)
    service.link._take_load_results()
    assert service.answers() == [(1, "unplayable")]
    assert service.link.take_command() is None


def test_load_in_another_mode_does_not_reach_the_builder(service: Service, snapshot: Snapshot) -> None:
    is_playing = not_in_this_mode("load", "playing")
    assert is_playing
    playing = msgspec.structs.replace(snapshot, mode="playing", refusals={"load": is_playing})
    service.link.publish_snapshot(playing)
    service.deliver(1, message())
    assert service.answers() == [(1, "is_playing")]
    assert service.loader.sent == []
    service.link.publish_snapshot(snapshot)
    service.deliver(2, message())
    assert service.answers() == []
    assert service.loader.sent != []


def test_recording_of_the_other_side_does_not_reach_the_builder(service: Service) -> None:
    service.deliver(1, message(side="right" if StationConfig().side == "left" else "left"))
    assert service.answers() == [(1, "other_side")]
    assert service.loader.sent == []


def test_a_second_load_meanwhile_is_refused(service: Service) -> None:
    service.deliver(1, message())
    service.deliver(2, message())
    assert service.answers() == [(2, "busy")]
    assert {part.id for part in service.loader.sent} == {1}


@pytest.mark.parametrize("command", [Stop(), Unload(), Teach(teaching_id="t")])
def test_load_is_discarded_by_an_intervening_command(service: Service, command: Command) -> None:
    service.deliver(1, message())
    service.deliver(2, command)
    assert (1, "stopped_meanwhile") in service.answers()
    # The builder still works on it.
    service.deliver(3, message())
    assert service.answers() == [(3, "busy")]
    service.link.take_stop()
    service.link.take_command()
    service.loader.answer(1, a_reference())
    service.link._take_load_results()
    assert service.link.take_command() is None
    assert service.answers() == []
    service.deliver(4, message())
    assert service.loader.sent[-1].id == 4


def test_load_stopped_between_its_parts_is_discarded(service: Service) -> None:
    *parts, last = parts_of(1, message())
    for part in parts:
        service.take(part)
    service.deliver(2, Stop())
    before = len(service.loader.sent)
    service.take(last)
    assert len(service.loader.sent) == before
    service.deliver(3, message())
    assert service.loader.sent[-1].id == 3


def test_a_load_without_end_is_refused(service: Service) -> None:
    head, *_ = parts_of(1, message())
    service.take(head)
    part = LoadPart(id=1, field="times_s", data=bytes(1 << 16), last=False)
    for _ in range(LONGEST_LOAD_BYTES >> 16):
        service.take(part)
    assert service.answers() == []
    service.take(part)
    service.take(part)
    assert service.answers() == [(1, "unplayable")]
    assert len(service.loader.sent) == 1 + (LONGEST_LOAD_BYTES >> 16)


def test_a_refused_recording_leaves_the_exchange_alive(tmp_path: Path) -> None:
    """Uses a real builder process: angles near the end of the float range, then an ordinary Load and a Stop."""
    near, device = socket.socketpair()
    loader = ReferenceLoader(StationConfig())
    with near, device:
        link = SocketServiceLink(StationConfig(), device, JournalSet(tmp_path), loader)
        loader.start(link.notify)
        link.start()
        near.settimeout(LIMIT_S)
        huge = message(angles(motor1=np.where(TIMES_S > 1, 1e308, -1e308)))
        near.sendall(frame(Request(id=1, command=huge)))
        (heard,) = frames(bytearray(near.recv(1 << 16)))
        reply = msgspec.msgpack.decode(heard, type=Reply)
        assert reply.refusal
        assert (reply.id, reply.refusal.code) == (1, "unplayable")
        near.sendall(frame(Request(id=2, command=message())))
        until(lambda: link._commands)
        taken = link.take_command()
        assert taken is not None
        assert taken.trajectory is not None
        near.sendall(frame(Request(id=3, command=Stop())))
        until(link.take_stop)
        assert not link.closing
        loader.finish()
        link.finish()


# -- the socket ---------------------------------------------------------------------------------------------------


def test_a_damaged_length_ends_the_connection_but_no_thread(tmp_path: Path) -> None:
    with running(tmp_path) as service:
        service._socket.sendall(b"\xff" * 8)
        until(lambda: service.link.closing)
        assert service.link._thread.is_alive()


def test_reply_is_sent_with_the_cycle_it_belongs_to(tmp_path: Path, snapshot: Snapshot) -> None:
    """A Load sent after a reply is checked against that cycle's snapshot, not the one before."""
    with running(tmp_path) as service:
        service.link.reply(Reply(id=1))
        service.ask(2, Stop())
        assert service.hear() == Reply(id=2)
        service.link.publish_snapshot(snapshot)
        service.link.wake()
        assert service.hear() == Reply(id=1)
