"""Connects control thread and service: receives commands, sends telemetry and reports finished journals.

The control thread's methods never wait. The I/O thread moves small messages between the queues and the service's socket
and does no long work, so that a Stop is processed at once. Other threads write the journals
(:mod:`kata.device.journal_set`) and wait for recordings to be checked (:mod:`kata.device.loader`).
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
from kata.device.ipc_messages import (
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
from kata.device.journal import JournalHeader, JournalWriter
from kata.device.journal_set import JournalSet, JournalThreads
from kata.device.late_command import STOPPED_MEANWHILE
from kata.device.references import Reference, unplayable
from kata.device.refusals import other_side
from kata.motion.ilc import Correction
from kata.motion.trajectory import Trajectory

log = logging.getLogger(__name__)

_POLL_S: Final = 0.01
_RECEIVE_BYTES: Final = 1 << 18
"""Maximum number of bytes received before the other sources are served again."""
_LARGE_READ_BYTES: Final = 1 << 16
"""A read of at least this size counts as part of a Load."""
_PAUSE_AFTER_LARGE_READ_S: Final = 0.001
"""Pause after a large read. It limits the processor time of a Load, because this thread has real-time priority and the
kernel thread that delivers the bus's bytes has none. A Stop that arrives during the pause is read after it.
"""
_MAX_QUEUED_SNAPSHOTS: Final = 20
_MAX_QUEUED_COMMANDS: Final = 100
_FINAL_SEND_LIMIT_S: Final = 1.0

_QUEUE_FULL: Final = Refusal.of(code="busy", message=texts.TOO_MANY_COMMANDS(), next_step=texts.WAIT_A_MOMENT())
_ALREADY_LOADING: Final = Refusal.of(
    code="busy", message=texts.CHECKING_ANOTHER_RECORDING(), next_step=texts.WAIT_THEN_LOAD_AGAIN()
)


@dataclass(frozen=True)
class QueuedCommand:
    """A command for the state machine. All checks that can run outside the control thread have been made."""

    id: int
    command: Command
    trajectory: Trajectory | None = None
    """Only a Load has a trajectory and a correction."""
    refusal: Refusal | None = None
    correction: Correction | None = None
    stop_requests: int = 0
    """Number of Stop commands received before this command."""


class Heartbeats(NamedTuple):
    """Number and content of the service's heartbeats."""

    received: int
    """Heartbeats received since the start."""
    expected_run_id: str | None
    """The run or teaching that the last heartbeat named. "" means none; None if the heartbeat had no such field."""


@dataclass
class _Loading:
    """A Load that has been accepted and is being received or checked."""

    request: Request
    stop_requests: int
    bytes_left: int = LONGEST_LOAD_BYTES
    complete: bool = False
    """True if the loader has all parts and will return a result."""
    discarded: bool = False
    """True if the Load has been answered already. The loader's result is then ignored."""


class Loader(Protocol):
    """Receives Loads and returns references: :class:`kata.device.loader.ReferenceLoader`."""

    def send(self, message: Request | LoadPart) -> None:
        """Pass on a Load or a part of it; never waits."""

    def results(self) -> Iterator[tuple[int, Reference | Refusal]]:
        """Return the new results, each with the id of its Load."""


class ServiceLink(Protocol):
    """The service as the control loop sees it. No method waits."""

    @property
    def stop_requests(self) -> int:
        """Number of Stop commands received; it never decreases. It includes Stops that :meth:`take_stop` has not returned
        yet.
        """

    @property
    def closing(self) -> bool:
        """True if the service has closed the connection or asked this process to end."""

    @property
    def heartbeats(self) -> Heartbeats:
        """Number of heartbeats received, and the run that the last heartbeat named."""

    @property
    def dropped(self) -> int:
        """Number of snapshots dropped because the service was slow."""

    @property
    def journal_ok(self) -> bool:
        """False if a journal cannot be written."""

    def take_stop(self) -> StopCode | None:
        """Return the reason to stop if a Stop arrived since the last cycle, else None. A Stop does not use the command queue,
        so no command is ahead of it.
        """

    def take_command(self) -> QueuedCommand | None:
        """Return the next command, or None. The loop calls this once in each cycle."""

    def service_age_ms(self, t_ns: int) -> float:
        """Return the milliseconds since the last message of the service; infinity if the service has closed the connection."""

    def reply(self, reply: Reply) -> None:
        """Answer a command."""

    def publish_event(self, event: Event) -> None:
        """Send an event."""

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        """Send the present state. If too many snapshots wait, the oldest is dropped."""

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        """Open a journal. The journal threads write it until it is finished."""

    def wake(self) -> None:
        """Wake the other threads at the end of a cycle to send the cycle's messages and write its samples."""


class SocketServiceLink:
    """The :class:`ServiceLink` of a device process: the queues and the threads that serve them."""

    def __init__(self, config: StationConfig, connection: socket.socket, journals: JournalSet, loader: Loader) -> None:
        """Prepare the threads. ``loader``: the caller starts it and makes it call :meth:`notify`."""
        self._config = config
        self._socket = connection
        self._journal_set = journals
        self._journal_threads = JournalThreads(journals, self._report_journal_closed, self._close)
        self._loader = loader
        self._loading: _Loading | None = None
        self._commands: deque[QueuedCommand] = deque()
        self._stops: deque[StopCode] = deque()
        """Stop commands that the control thread has not taken yet."""
        self._last_received_ns = time.monotonic_ns()
        self._snapshots: deque[Snapshot] = deque()
        self._latest_snapshot: Snapshot | None = None
        self._replies: list[Reply] = []
        """Replies of this cycle, which :meth:`wake` sends."""
        self._outbound_messages: deque[Reply | Event | JournalClosed] = deque()
        self._finished = threading.Event()
        self._woken = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._serve, name="io", daemon=True)
        self._receive_buffer = memoryview(bytearray(_RECEIVE_BYTES))
        """Allocated once. With locked memory the kernel would have to clear 64 pages at once for each new buffer."""
        self._decoder = msgspec.msgpack.Decoder(ToDevice)
        self.closing = False
        """True if the service has closed the connection or asked this process to end."""
        self.heartbeats: Heartbeats = Heartbeats(0, None)
        """Number of heartbeats received, and the run that the last heartbeat named."""
        self.dropped = 0
        """Number of snapshots dropped because the service was slow."""
        self.stop_requests = 0
        """Number of Stop commands received."""

    def start(self) -> None:
        """Start the threads."""
        self._thread.start()
        self._journal_threads.start()

    def finish(self) -> None:
        """Write the last journal to disk and send the last messages. Call this when the control thread has ended."""
        self._journal_threads.finish()
        self._finished.set()
        self._wake_io()
        self._thread.join()
        os.close(self._woken)

    # -- called by the control thread -----------------------------------------------------------------------------

    def take_stop(self) -> StopCode | None:
        """See :class:`ServiceLink`."""
        first: StopCode | None = None
        while self._stops:
            because = self._stops.popleft()
            first = first or because
        return first

    def take_command(self) -> QueuedCommand | None:
        """See :class:`ServiceLink`.

        A Stop may arrive at any moment. The I/O thread first counts the Stop, then queues it for :meth:`take_stop`, then
        discards the queued commands. Later commands carry the new count. A command with an old count therefore arrived
        before the Stop, and this method took it just before the I/O thread could discard it: this method refuses it. A
        command with the new count arrived after the Stop and must not run before it. While the Stop is still queued, this
        method therefore leaves the command for the next cycle, which takes the Stop first.
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

        Replies are sent only now, after the snapshot. After a reply the service may send a Load, which is checked
        against this cycle's snapshot.
        """
        self._outbound_messages.extend(self._replies)
        self._replies.clear()
        self._wake_io()
        self._journal_threads.wake()

    # -- called by the other threads ------------------------------------------------------------------------------

    def notify(self) -> None:
        """Wake the I/O thread, because the loader has a result."""
        self._wake_io()

    def _wake_io(self) -> None:
        os.eventfd_write(self._woken, 1)

    def _report_journal_closed(self, journal: Path) -> None:
        self._outbound_messages.append(JournalClosed(path=str(journal)))

    def _close(self) -> None:
        """Tell the control thread to end, because it must not run without the other threads."""
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
            log.info("the service has closed the connection")
            self.closing = True
            return
        incoming += self._receive_buffer[:count]
        try:
            for encoded in frames(incoming):
                self._last_received_ns = time.monotonic_ns()
                self._decode(encoded)
        except ValueError as error:
            log.error("invalid data from the service, closing the link: %s", error)
            self.closing = True
        if count >= _LARGE_READ_BYTES:
            time.sleep(_PAUSE_AFTER_LARGE_READ_S)

    def _decode(self, encoded: bytes) -> None:
        try:
            message = self._decoder.decode(encoded)
        except msgspec.MsgspecError as error:
            log.error("ignored an invalid message: %s", error)
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
        """Count the Stop, queue it and discard the queued commands, in this order. :meth:`take_command` explains the order."""
        self.stop_requests += 1
        self._stops.append(because)
        while self._commands:
            # The control thread may have just taken the last command.
            with suppress(IndexError):
                self._refuse(self._commands.popleft().id, STOPPED_MEANWHILE)
        self._discard_load(STOPPED_MEANWHILE)
        self._outbound_messages.append(Reply(id=request_id))

    def _refuse(self, request_id: int, refusal: Refusal) -> None:
        self._outbound_messages.append(Reply(id=request_id, refusal=refusal))

    # -- loading --------------------------------------------------------------------------------------------------

    def _begin_load(self, request: Request, load: Load) -> None:
        """Refuse the Load if that is possible before the check, else send it to the loader. The control thread decides after the check."""
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
            # The loader works on this Load until it returns a result.
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
        # While the service does not read, snapshots wait in the queue and the oldest are dropped.
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
