"""Between the control thread and everybody else: commands in, telemetry and journals out.

The control thread's side takes and leaves without ever waiting. The I/O thread's side moves bytes between queues, the
socket to the service and the journal files; a third thread only waits for the disk.
"""

import logging
import math
import os
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import msgspec
import numpy as np

from kata.device.config import StationConfig
from kata.device.journal import JournalHeader, JournalWriter
from kata.device.keeper import JournalKeeper, next_sync_ns
from kata.device.messages import (
    LOAD_LEVELS,
    Command,
    Event,
    FromDevice,
    Heartbeat,
    JournalClosed,
    Load,
    Refusal,
    Reply,
    Request,
    Snapshot,
    Stop,
    StopCode,
    ToDevice,
    frame,
    frames,
)
from kata.device.refusals import stopped_meanwhile
from kata.motion.axes import N_AXES
from kata.motion.learning import LARGEST_DEG, Correction
from kata.motion.method import rate_hz, reference
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError

log = logging.getLogger(__name__)

_POLL_S: Final = 0.01
_SNAPSHOTS_KEPT: Final = 20
_COMMANDS_KEPT: Final = 100
_LAST_WORDS_S: Final = 1.0


class _UnusableError(ValueError):
    """It cannot be played in this way; the message says why."""


@dataclass(frozen=True)
class Taken:
    """A command on its way to the machine; what could be checked outside the control thread has been."""

    id: int
    command: Command
    trajectory: Trajectory | None
    refusal: Refusal | None
    correction: Correction | None = None


class Counterpart(Protocol):
    """What the control loop wants of whoever is on the other side; nothing here ever waits."""

    @property
    def closing(self) -> bool:
        """The service is gone, or asked this process to end."""

    @property
    def belief(self) -> tuple[int, str | None]:
        """How many heartbeats came, and the run that the last one named."""

    @property
    def stop_requests(self) -> int:
        """How many Stop commands have come; each counts before any command that came after it can be taken."""

    @property
    def dropped(self) -> int:
        """Snapshots that a slow service never got."""

    @property
    def journal_ok(self) -> bool:
        """Everything measured has found its way to the disk so far."""

    def take_stop(self) -> StopCode | None:
        """Why to stop, if a Stop has come since the last cycle. It is a flag of its own, no command can be before it."""

    def take_command(self) -> Taken | None:
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


class Exchange:
    """The queues, and the threads that serve them: the :class:`Counterpart` of a device process."""

    def __init__(self, config: StationConfig, connection: socket.socket, journal_folder: Path) -> None:
        self._config = config
        self._socket = connection
        self._journals = JournalKeeper(journal_folder)
        self._commands: deque[Taken] = deque()
        self._stop_requested: StopCode | None = None
        self.stop_requests = 0
        """How many Stop commands have come."""
        self._heard_ns = time.monotonic_ns()
        self._snapshots: deque[Snapshot] = deque()
        self._letters: deque[Reply | Event | JournalClosed] = deque()
        self._ended = threading.Event()
        self._woken = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._serve, args=(self._move_bytes,), name="io", daemon=True)
        self._syncing = threading.Thread(target=self._serve, args=(self._keep_synced,), name="sync", daemon=True)
        self._decoder = msgspec.msgpack.Decoder(ToDevice)
        self.closing = False
        """The service is gone, or asked this process to end."""
        self.belief: tuple[int, str | None] = (0, None)
        """How many heartbeats came, and the run that the last one named."""
        self.dropped = 0
        """Snapshots that a slow service never got."""

    def start(self) -> None:
        """Start both threads."""
        self._thread.start()
        self._syncing.start()

    def finish(self) -> None:
        """The control thread has ended: let the last journal reach the disk and the last words the service."""
        self._ended.set()
        self._thread.join()
        os.close(self._woken)

    # -- the control thread's side --------------------------------------------------------------------------------

    def take_stop(self) -> StopCode | None:
        """See :class:`Counterpart`."""
        requested, self._stop_requested = self._stop_requested, None
        return requested

    def take_command(self) -> Taken | None:
        """See :class:`Counterpart`."""
        return self._commands.popleft() if self._commands else None

    def service_age_ms(self, t_ns: int) -> float:
        """See :class:`Counterpart`."""
        return math.inf if self.closing else (t_ns - self._heard_ns) / 1e6

    def reply(self, reply: Reply) -> None:
        """See :class:`Counterpart`."""
        self._letters.append(reply)

    def publish_event(self, event: Event) -> None:
        """See :class:`Counterpart`."""
        self._letters.append(event)

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        """See :class:`Counterpart`."""
        if len(self._snapshots) >= _SNAPSHOTS_KEPT:
            self._snapshots.popleft()
            self.dropped += 1
        self._snapshots.append(snapshot)

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        """See :class:`Counterpart`."""
        return self._journals.open(header)

    @property
    def journal_ok(self) -> bool:
        """See :class:`Counterpart`."""
        return self._journals.ok

    def wake(self) -> None:
        """See :class:`Counterpart`."""
        os.eventfd_write(self._woken, 1)

    # -- the other threads' side ----------------------------------------------------------------------------------

    def _serve(self, part: Callable[[], None]) -> None:
        try:
            part()
        finally:
            # Whatever ends this thread, the control thread must not go on without it.
            self.closing = True

    def _keep_synced(self) -> None:
        """Until the control thread has ended; the I/O thread does it for the last time."""
        due_ns = time.monotonic_ns()
        while not self._ended.wait(max(0, due_ns - time.monotonic_ns()) / 1e9):
            began_ns = time.monotonic_ns()
            self._sync_journals()
            due_ns = next_sync_ns(began_ns, time.monotonic_ns())

    def _move_bytes(self) -> None:
        incoming = bytearray()
        outgoing = bytearray()
        self._socket.setblocking(False)
        while not self._ended.is_set():
            sources: list[socket.socket | int] = [self._woken] if self.closing else [self._woken, self._socket]
            wants_write = [self._socket] if outgoing else []
            readable, _, _ = select.select(sources, wants_write, [], _POLL_S)
            if self._woken in readable:
                os.eventfd_read(self._woken)
            self._journals.write()
            if self._socket in readable:
                self._receive(incoming)
            self._send(outgoing)
        self._syncing.join()
        self._journals.write()
        self._sync_journals()
        until_ns = time.monotonic_ns() + int(_LAST_WORDS_S * 1e9)
        self._send(outgoing)
        while outgoing and time.monotonic_ns() < until_ns:
            select.select([], [self._socket], [], _POLL_S)
            self._send(outgoing)

    def _receive(self, incoming: bytearray) -> None:
        try:
            data = self._socket.recv(1 << 20)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            log.info("the service is gone")
            self.closing = True
            return
        incoming += data
        for data in frames(incoming):
            self._heard_ns = time.monotonic_ns()
            try:
                message = self._decoder.decode(data)
            except msgspec.MsgspecError as error:
                log.error("a message that cannot be understood was ignored: %s", error)
                continue
            if isinstance(message, Heartbeat):
                self.belief = (self.belief[0] + 1, message.run_id)
            else:
                self._accept(message)

    def _accept(self, request: Request) -> None:
        if isinstance(request.command, Stop):
            self.stop_requests += 1
            self._stop_requested = self._stop_requested or request.command.because
            for _ in range(len(self._commands)):
                discarded = self._commands.popleft()
                self._letters.append(Reply(id=discarded.id, refusal=stopped_meanwhile()))
            self._letters.append(Reply(id=request.id))
            return
        if len(self._commands) >= _COMMANDS_KEPT:
            crowded = Refusal(code="busy", message="Too many commands are waiting.", next_step="Wait a moment.")
            self._letters.append(Reply(id=request.id, refusal=crowded))
            return
        self._commands.append(checked(request, self._config))

    def _sync_journals(self) -> None:
        for path in self._journals.sync():
            self._letters.append(JournalClosed(path=str(path)))

    def _send(self, outgoing: bytearray) -> None:
        if self.closing and not outgoing and not self._letters:
            return
        # Snapshots wait here, and the oldest are dropped, while the service does not read.
        if len(outgoing) < 1 << 16:
            messages: list[FromDevice] = [self._letters.popleft() for _ in range(len(self._letters))]
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


def checked(request: Request, config: StationConfig) -> Taken:
    """A command with all that can be worked out before the control thread has it: a long recording costs that nothing."""
    trajectory: Trajectory | None = None
    correction: Correction | None = None
    refusal: Refusal | None = None
    if isinstance(request.command, Load):
        try:
            trajectory = _trajectory(request.command, config)
            correction = _correction(request.command, trajectory)
        except TrajectoryError as error:
            refusal = Refusal(
                code="unplayable",
                message=f"This recording cannot be played: {error}.",
                next_step="Teach the motion again, within the range and more slowly.",
            )
        except _UnusableError as error:
            refusal = Refusal(
                code="unusable", message=f"This cannot be played so: {error}.", next_step="Choose another method."
            )
    return Taken(request.id, request.command, trajectory, refusal, correction)


def _trajectory(load: Load, config: StationConfig) -> Trajectory:
    try:
        times = np.frombuffer(load.times_s, dtype="<f8")
        angles = np.frombuffer(load.angles_deg, dtype="<f8").reshape(-1, len(config.axes))
    except ValueError as error:
        raise TrajectoryError("its samples are cut short") from error
    if config.cycle_hz % rate_hz(load.method, config.rate_hz):
        raise _UnusableError("this station's cycles do not divide into the paper's 10 Hz")
    trajectory = reference(load.method, times, angles)
    if not 1 <= load.load_level <= LOAD_LEVELS:
        raise TrajectoryError(f"its load level must be 1 to {LOAD_LEVELS}")
    if load.limits_deg and len(load.limits_deg) != len(config.axes):
        raise TrajectoryError("it has limits for some axes only")
    if load.max_speed_deg_s is not None and not 0 < load.max_speed_deg_s < math.inf:
        raise TrajectoryError("the patient's speed limit must be above 0 deg/s")
    config.with_speed_limit(load.max_speed_deg_s).check_reference(load.method, trajectory)
    if load.limits_deg:
        patients = [
            AxisLimits(low, high, axis.max_speed_deg_s)
            for axis, (low, high) in zip(config.axes, load.limits_deg, strict=True)
        ]
        trajectory.check(patients, 0.0)
    return trajectory


def _correction(load: Load, trajectory: Trajectory) -> Correction | None:
    """What was learned, whole and bounded, or nothing."""
    if not load.correction_deg:
        return None
    if load.method != "learned":
        raise _UnusableError("a correction belongs to the learned method only")
    if len(load.correction_deg) % (N_AXES * 8):
        raise _UnusableError("what was learned is cut short")
    angles = np.frombuffer(load.correction_deg, dtype="<f8").reshape(-1, N_AXES)
    step_s = load.correction_step_s
    # Its last row lies within a step of the recording's end. What is no number is within no limit.
    lasts_s = trajectory.duration_s
    if not (0 < step_s <= lasts_s and len(angles) >= 2 and abs((len(angles) - 1) * step_s - lasts_s) <= step_s):
        raise _UnusableError("what was learned is as long as another recording")
    if not np.all(np.abs(angles) <= LARGEST_DEG):
        raise _UnusableError(f"what was learned is more than {LARGEST_DEG:g} deg somewhere")
    return Correction(step_s, angles)
