"""Starts and watches the device process, and starts a new one when it has ended. A new process resumes no run."""

import asyncio
import contextlib
import logging
import socket
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from kata.device.ipc_messages import FromDevice, Heartbeat, Load, Reply, Request, Snapshot, ToDevice, frames, frames_of

log = logging.getLogger(__name__)

_HEARTBEAT_S: Final = 0.05
_AT_REST: Final = ("idle", "offline")
"""Modes in which no command switches torque on. The device supervises its service only while it controls torque."""
_RESTART_S: Final = (0.5, 1.0, 2.0, 5.0)
"""Pauses before the first, second and third restart, and before all later ones."""
_RESET_FAILURES_AFTER_S: Final = 30.0
"""If a process has run for this long, the next pause is the first one again."""
_END_LIMIT_S: Final = 5.0


@dataclass(frozen=True)
class DeviceLaunch:
    """The parameters with which a device process is started."""

    station_file: Path
    journal_folder: Path
    real_time: bool
    """If False, the process requests no real-time privileges."""

    @property
    def log_path(self) -> Path:
        """Return the file of the process's log, beside the journal folder."""
        return self.journal_folder.parent / "device.log"


class DeviceProcess:
    """Owns the child process and the socket to it.

    The service's event loop sends the heartbeats, not a thread, so that they stop when the loop hangs.
    """

    def __init__(
        self,
        launch: DeviceLaunch,
        on_message: Callable[[FromDevice], None],
        on_end: Callable[[], None],
        occupation_id: Callable[[], str],
    ) -> None:
        """Prepare without starting. ``occupation_id`` returns the id of the run or teaching that the service expects, "" for none."""
        self._launch = launch
        self._on_message = on_message
        self._on_end = on_end
        self._occupation_id = occupation_id
        self._writer: asyncio.StreamWriter | None = None
        self._child: asyncio.subprocess.Process | None = None
        self._supervisor: asyncio.Task[None] | None = None
        self._sending: dict[int, asyncio.Task[None]] = {}
        self._decoder = msgspec.msgpack.Decoder(FromDevice)
        self._left_rest = asyncio.Event()
        """Set while the device may need a heartbeat every 50 ms. At rest it gets one after each of its snapshots, which needs no timer."""
        self._left_rest.set()

    @property
    def running(self) -> bool:
        """True if a process is connected."""
        return self._writer is not None

    def start(self) -> None:
        """Start a process, and start a new one whenever it ends."""
        self._supervisor = asyncio.create_task(self._supervise(), name="device process")

    def send(self, message: ToDevice) -> None:
        """Queue a message. If no process runs, the message is lost and gets no reply.

        The parts of a Load follow as the socket accepts them, until the Load is answered. Other messages may be sent between the parts.
        """
        if self._writer is not None and not self._writer.is_closing():
            parts = frames_of(message)
            self._writer.write(next(parts))
            if isinstance(message, Request) and isinstance(message.command, Load):
                self._sending[message.id] = asyncio.create_task(
                    self._send_parts(self._writer, parts), name="a load's parts"
                )

    def beat(self) -> None:
        """Send a heartbeat with the id of the run or teaching that the service expects."""
        self.send(Heartbeat(run_id=self._occupation_id()))

    async def close(self) -> None:
        """Close the socket, and wait until the process has stopped the arm, saved its journal and ended."""
        if self._supervisor:
            self._supervisor.cancel()
            await asyncio.gather(self._supervisor, return_exceptions=True)
        if self._writer:
            self._writer.close()
            self._writer = None
        if self._child:
            await self._wait_for_end(self._child)

    async def _supervise(self) -> None:
        failures = 0
        loop = asyncio.get_running_loop()
        while True:
            began = loop.time()
            try:
                await self._run_one()
            except OSError as error:
                log.error("the device process cannot be started: %s", error)
            failures = 1 if loop.time() - began > _RESET_FAILURES_AFTER_S else failures + 1
            pause_s = _RESTART_S[min(failures, len(_RESTART_S)) - 1]
            log.warning("the device process has ended; a new one starts in %.1f s", pause_s)
            await asyncio.sleep(pause_s)

    async def _run_one(self) -> None:
        ours, theirs = socket.socketpair()
        with contextlib.ExitStack() as on_failure, theirs, self._launch.log_path.open("ab") as log_file:
            # The service may close while the process starts.
            on_failure.callback(ours.close)
            self._child = await asyncio.create_subprocess_exec(
                sys.executable,
                *("-m", "kata.device"),
                *("--station", str(self._launch.station_file)),
                *("--journal", str(self._launch.journal_folder)),
                *("--socket", str(theirs.fileno())),
                *(() if self._launch.real_time else ("--no-real-time",)),
                pass_fds=[theirs.fileno()],
                stderr=log_file,
                start_new_session=True,
            )
            reader, self._writer = await asyncio.open_connection(sock=ours)
            on_failure.pop_all()
        beating = asyncio.create_task(self._beat(), name="heartbeats")
        try:
            await self._listen(reader)
        except ValueError as error:
            log.error("a message of the device process cannot be decoded: %s", error)
        finally:
            for sending in (beating, *self._sending.values()):
                sending.cancel()
            self._sending.clear()
        self._writer.close()
        self._writer = None
        self._left_rest.set()
        await self._wait_for_end(self._child)
        self._on_end()

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        incoming = bytearray()
        while data := await self._read(reader):
            incoming += data
            for encoded in frames(incoming):
                message = self._decoder.decode(encoded)
                if isinstance(message, Reply) and (sending := self._sending.pop(message.id, None)):
                    sending.cancel()
                self._on_message(message)
                if isinstance(message, Snapshot):
                    self._beat_after(message)

    def _beat_after(self, snapshot: Snapshot) -> None:
        if snapshot.mode in _AT_REST:
            self._left_rest.clear()
            self.beat()
        else:
            self._left_rest.set()

    @staticmethod
    async def _read(reader: asyncio.StreamReader) -> bytes:
        try:
            return await reader.read(1 << 20)
        except ConnectionError:
            return b""

    async def _beat(self) -> None:
        while True:
            await self._left_rest.wait()
            self.beat()
            await asyncio.sleep(_HEARTBEAT_S)

    @staticmethod
    async def _send_parts(writer: asyncio.StreamWriter, parts: Iterator[bytes]) -> None:
        with contextlib.suppress(ConnectionError):  # The process has ended.
            for part in parts:
                writer.write(part)
                await writer.drain()

    @staticmethod
    async def _wait_for_end(child: asyncio.subprocess.Process) -> None:
        try:
            async with asyncio.timeout(_END_LIMIT_S):
                await child.wait()
        except TimeoutError:
            log.error("the device process did not end and is killed; the drives' watchdog stops them")
            child.kill()
            await child.wait()
