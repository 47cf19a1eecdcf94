"""Between the control thread and the service: commands in, telemetry and journals out.

The control thread's side takes and leaves without ever waiting. The I/O thread's side moves small messages between queues
and the socket to the service, and does nothing that takes long: a Stop waits for nothing. Threads of their own write the
journals (:mod:`kata.device.journal_set`) and wait for recordings to be checked (:mod:`kata.device.loader`).
"""

import logging
import math
import os
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple, Protocol

import msgspec

from kata.device import texts
from kata.device.config import StationConfig
from kata.device.journal import JournalHeader, JournalWriter
from kata.device.journal_set import JournalSet, JournalThreads
from kata.device.messages import (
    LONGEST_LOAD_BYTES,
    Command,
    Event,
    FromDevice,
    Heartbeat,
    JournalClosed,
    Load,
    LoadPart,
    Refusal,
    Reply,
    Request,
    Snapshot,
    Stop,
    StopCode,
    Teach,
    ToDevice,
    Unload,
    frame,
    frames,
)
from kata.device.references import Reference, unplayable
from kata.device.refusals import STOPPED_MEANWHILE, other_side
from kata.motion.learning import Correction
from kata.motion.trajectory import Trajectory

log = logging.getLogger(__name__)

_POLL_S: Final = 0.01
_RECEIVE_BYTES: Final = 1 << 18
"""Limits how much is received before the other sources are looked at again."""
_LARGE_READ_BYTES: Final = 1 << 16
"""So much at once are parts of a Load."""
_PAUSE_AFTER_LARGE_READ_S: Final = 0.001
"""After so much, to limit the processor's time that a Load takes: the kernel thread that brings the bus's bytes has no priority, and
this thread has one. A Stop may wait for it."""
_MAX_QUEUED_SNAPSHOTS: Final = 20
_MAX_QUEUED_COMMANDS: Final = 100
_FINAL_SEND_LIMIT_S: Final = 1.0

_QUEUE_FULL: Final = Refusal.of(code="busy", message=texts.TOO_MANY_COMMANDS(), next_step=texts.WAIT_A_MOMENT())
_ALREADY_LOADING: Final = Refusal.of(
    code="busy", message=texts.CHECKING_ANOTHER_RECORDING(), next_step=texts.WAIT_THEN_LOAD_AGAIN()
)


@dataclass(frozen=True)
class QueuedCommand:
    """A command on its way to the machine; what could be checked outside the control thread has been."""

    id: int
    command: Command
    trajectory: Trajectory | None = None
    """Of a Load, as its correction."""
    refusal: Refusal | None = None
    correction: Correction | None = None
    stop_requests: int = 0
    """How many Stop commands had come before it."""


class Heartbeats(NamedTuple):
    """What the heartbeats of the service have reported."""

    received: int
    """Heartbeats received since the start."""
    expected_run_id: str | None
    """The run or teaching that the last heartbeat named; "" for none, None if it did not say."""


@dataclass
class _Loading:
    """A Load that has been accepted, and is being received or checked."""

    request: Request
    stop_requests: int
    bytes_left: int = LONGEST_LOAD_BYTES
    complete: bool = False
    """All of it is with the loader, which will have a result."""
    discarded: bool = False
    """It has been answered; its result is not wanted."""


class Loader(Protocol):
    """What takes Loads and brings references back: :class:`kata.device.loader.ReferenceLoader`."""

    def send(self, message: Request | LoadPart) -> None:
        """Pass on a Load or a part of it; never waits."""

    def results(self) -> Iterator[tuple[int, Reference | Refusal]]:
        """Take what has come since the last time, each with the id of its Load."""


class ServiceLink(Protocol):
    """What the control loop wants of the other side; nothing here ever waits."""

    @property
    def stop_requests(self) -> int:
        """How many Stop commands have come; it only grows. One that :meth:`take_stop` has not returned yet is counted already."""

    @property
    def closing(self) -> bool:
        """The service is gone, or asked this process to end."""

    @property
    def heartbeats(self) -> Heartbeats:
        """How many heartbeats came, and the run that the last one named."""

    @property
    def dropped(self) -> int:
        """Snapshots that a slow service never got."""

    @property
    def journal_ok(self) -> bool:
        """Everything measured has found its way to the disk so far."""

    def take_stop(self) -> StopCode | None:
        """Why to stop, if a Stop has come since the last cycle. It is a flag of its own, no command can be before it."""

    def take_command(self) -> QueuedCommand | None:
        """At most one command a cycle."""

    def service_age_ms(self, t_ns: int) -> float:
        """Since the service was last heard; infinite when it is gone."""

    def reply(self, reply: Reply) -> None:
        """Answer a command."""

    def publish_event(self, event: Event) -> None:
        """Tell what happened."""

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        """Tell the present state; one unsent may give way."""

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        """A new journal, which is written until it is finished."""

    def wake(self) -> None:
        """At the end of a cycle: what it has left, its sample above all, goes on its way now."""


class SocketServiceLink:
    """The queues, and the threads that serve them: the :class:`ServiceLink` of a device process."""

    def __init__(self, config: StationConfig, connection: socket.socket, journals: JournalSet, loader: Loader) -> None:
        """``loader``: started, and told to call :meth:`wake`, by the caller."""
        self._config = config
        self._socket = connection
        self._journal_set = journals
        self._journal_threads = JournalThreads(journals, self._report_journal_closed, self._close)
        self._loader = loader
        self._loading: _Loading | None = None
        self._commands: deque[QueuedCommand] = deque()
        self._stops: deque[StopCode] = deque()
        """Stop commands that the control thread has not taken."""
        self._last_received_ns = time.monotonic_ns()
        self._snapshots: deque[Snapshot] = deque()
        self._latest_snapshot: Snapshot | None = None
        self._replies: list[Reply] = []
        """Of this cycle."""
        self._outbound_messages: deque[Reply | Event | JournalClosed] = deque()
        self._finished = threading.Event()
        self._woken = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._serve, name="io", daemon=True)
        self._receive_buffer = memoryview(bytearray(_RECEIVE_BYTES))
        """Kept: with locked memory each new one would be 64 pages that the kernel clears at once."""
        self._decoder = msgspec.msgpack.Decoder(ToDevice)
        self.closing = False
        """The service is gone, or asked this process to end."""
        self.heartbeats: Heartbeats = Heartbeats(0, None)
        """How many heartbeats came, and the run that the last one named."""
        self.dropped = 0
        """Snapshots that a slow service never got."""
        self.stop_requests = 0
        """How many Stop commands have come."""

    def start(self) -> None:
        """Start the threads."""
        self._thread.start()
        self._journal_threads.start()

    def finish(self) -> None:
        """The control thread has ended: let the last journal reach the disk and the last words the service."""
        self._journal_threads.finish()
        self._finished.set()
        self._wake_io()
        self._thread.join()
        os.close(self._woken)

    # -- the control thread's side --------------------------------------------------------------------------------

    def take_stop(self) -> StopCode | None:
        """See :class:`ServiceLink`."""
        first: StopCode | None = None
        while self._stops:
            because = self._stops.popleft()
            first = first or because
        return first

    def take_command(self) -> QueuedCommand | None:
        """See :class:`ServiceLink`.

        A Stop may come at any moment in between. The I/O thread first counts it, then leaves it for :meth:`take_stop`, then
        discards what is queued; what comes later bears the new count. So a command with an old count came before the Stop and is
        discarded here, if it was taken just before the I/O thread would have done so. One with the new count, while the Stop still
        waits, came after it and must not be carried out before it: it waits for the next cycle, which takes the Stop first.
        """
        try:
            taken = self._commands.popleft()
        except IndexError:
            return None
        if taken.stop_requests != self.stop_requests:
            self.reply(Reply(id=taken.id, refusal=STOPPED_MEANWHILE))
            return None
        if self._stops:
            self._commands.appendleft(taken)
            return None
        return taken

    def service_age_ms(self, t_ns: int) -> float:
        """See :class:`ServiceLink`."""
        return math.inf if self.closing else (t_ns - self._last_received_ns) / 1e6

    def reply(self, reply: Reply) -> None:
        """See :class:`ServiceLink`."""
        self._replies.append(reply)

    def publish_event(self, event: Event) -> None:
        """See :class:`ServiceLink`."""
        self._outbound_messages.append(event)

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        """See :class:`ServiceLink`."""
        if len(self._snapshots) >= _MAX_QUEUED_SNAPSHOTS:
            self._snapshots.popleft()
            self.dropped += 1
        self._latest_snapshot = snapshot
        self._snapshots.append(snapshot)

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        """See :class:`ServiceLink`."""
        return self._journal_set.open(header)

    @property
    def journal_ok(self) -> bool:
        """See :class:`ServiceLink`."""
        return self._journal_set.ok

    def wake(self) -> None:
        """See :class:`ServiceLink`.

        Replies go now: the service may send a Load on the strength of one, which is judged by this cycle's snapshot.
        """
        self._outbound_messages.extend(self._replies)
        self._replies.clear()
        self._wake_io()
        self._journal_threads.wake()

    # -- the other threads' side ----------------------------------------------------------------------------------

    def notify(self) -> None:
        """The loader has a result."""
        self._wake_io()

    def _wake_io(self) -> None:
        os.eventfd_write(self._woken, 1)

    def _report_journal_closed(self, journal: Path) -> None:
        self._outbound_messages.append(JournalClosed(path=str(journal)))

    def _close(self) -> None:
        """A thread has ended: the control thread must not go on without it."""
        self.closing = True

    def _serve(self) -> None:
        try:
            self._move_messages()
        finally:
            self._close()

    def _move_messages(self) -> None:
        incoming = bytearray()
        outgoing = bytearray()
        self._socket.setblocking(False)
        while not self._finished.is_set():
            sources: list[socket.socket | int] = [self._woken] if self.closing else [self._woken, self._socket]
            wants_write = [self._socket] if outgoing else []
            readable, _, _ = select.select(sources, wants_write, [], _POLL_S)
            if self._woken in readable:
                os.eventfd_read(self._woken)
            if self._socket in readable:
                self._receive(incoming)
            self._take_load_results()
            self._send(outgoing)
        self._outbound_messages.extend(self._replies)
        until_ns = time.monotonic_ns() + int(_FINAL_SEND_LIMIT_S * 1e9)
        self._send(outgoing)
        while outgoing and time.monotonic_ns() < until_ns:
            select.select([], [self._socket], [], _POLL_S)
            self._send(outgoing)

    def _receive(self, incoming: bytearray) -> None:
        try:
            count = self._socket.recv_into(self._receive_buffer)
        except BlockingIOError:
            return
        except OSError:
            count = 0
        if not count:
            log.info("the service is gone")
            self.closing = True
            return
        incoming += self._receive_buffer[:count]
        try:
            for encoded in frames(incoming):
                self._last_received_ns = time.monotonic_ns()
                self._decode(encoded)
        except ValueError as error:
            log.error("the service cannot be understood any more: %s", error)
            self.closing = True
        if count >= _LARGE_READ_BYTES:
            time.sleep(_PAUSE_AFTER_LARGE_READ_S)

    def _decode(self, encoded: bytes) -> None:
        try:
            message = self._decoder.decode(encoded)
        except msgspec.MsgspecError as error:
            log.error("a message that cannot be understood was ignored: %s", error)
            return
        match message:
            case Heartbeat():
                self.heartbeats = Heartbeats(self.heartbeats.received + 1, message.run_id)
            case LoadPart():
                self._take_part(message)
            case Request():
                self._accept(message)

    def _accept(self, request: Request) -> None:
        match request.command:
            case Stop():
                self._stop(request.id, request.command.because)
                return
            case Load():
                self._begin_load(request, request.command)
                return
            case Teach() | Unload():
                self._discard_load(STOPPED_MEANWHILE)
        if len(self._commands) >= _MAX_QUEUED_COMMANDS:
            self._refuse(request.id, _QUEUE_FULL)
        else:
            self._commands.append(QueuedCommand(request.id, request.command, stop_requests=self.stop_requests))

    def _stop(self, request_id: int, because: StopCode) -> None:
        """In this order: see :meth:`take_command`."""
        self.stop_requests += 1
        self._stops.append(because)
        while self._commands:
            # The control thread may have taken the last one just now.
            with suppress(IndexError):
                self._refuse(self._commands.popleft().id, STOPPED_MEANWHILE)
        self._discard_load(STOPPED_MEANWHILE)
        self._outbound_messages.append(Reply(id=request_id))

    def _refuse(self, request_id: int, refusal: Refusal) -> None:
        self._outbound_messages.append(Reply(id=request_id, refusal=refusal))

    # -- loading --------------------------------------------------------------------------------------------------

    def _begin_load(self, request: Request, load: Load) -> None:
        """Refuse what can be refused at once; the control thread has the last word when the recording has been checked."""
        refusal_in_mode = self._latest_snapshot.refusals.get("load") if self._latest_snapshot else None
        refusal = (
            refusal_in_mode or other_side(load.side, self._config.side) or (_ALREADY_LOADING if self._loading else None)
        )
        if refusal:
            self._refuse(request.id, refusal)
        else:
            self._loading = _Loading(request, self.stop_requests)
            self._loader.send(request)

    def _take_part(self, part: LoadPart) -> None:
        loading = self._loading
        if loading is None or loading.request.id != part.id or loading.discarded:
            return
        loading.bytes_left -= len(part.data)
        if loading.bytes_left < 0:
            self._discard_load(unplayable(texts.NOT_PLAYABLE_TOO_LONG()))
            return
        loading.complete = part.last
        self._loader.send(part)

    def _discard_load(self, refusal: Refusal) -> None:
        loading = self._loading
        if loading is None or loading.discarded:
            return
        self._refuse(loading.request.id, refusal)
        if loading.complete:
            # The loader is busy with it until its result comes.
            loading.discarded = True
        else:
            self._loading = None

    def _take_load_results(self) -> None:
        for request_id, result in self._loader.results():
            loading = self._loading
            if loading is None or loading.request.id != request_id:
                continue
            self._loading = None
            if loading.discarded:
                continue
            if isinstance(result, Refusal):
                self._refuse(request_id, result)
                continue
            command, count = loading.request.command, loading.stop_requests
            self._commands.append(QueuedCommand(request_id, command, result.trajectory, None, result.correction, count))

    # -- to the service -------------------------------------------------------------------------------------------

    def _send(self, outgoing: bytearray) -> None:
        if self.closing and not outgoing and not self._outbound_messages:
            return
        # Snapshots wait here, and the oldest are dropped, while the service does not read.
        if len(outgoing) < 1 << 16:
            messages: list[FromDevice] = [
                self._outbound_messages.popleft() for _ in range(len(self._outbound_messages))
            ]
            messages += [self._snapshots.popleft() for _ in range(len(self._snapshots))]
            for message in messages:
                outgoing += frame(message)
        try:
            if outgoing:
                del outgoing[: self._socket.send(outgoing)]
        except BlockingIOError:
            pass
        except OSError:
            self.closing = True
            outgoing.clear()
