"""Sends a Load to the reference builder and returns the result. A separate thread waits for the builder.

The I/O thread adds messages and takes results without waiting.
"""

import logging
import os
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from queue import SimpleQueue
from typing import Final

import msgspec

from kata.device import texts
from kata.device.config import StationConfig
from kata.device.ipc_messages import LoadPart, Refusal, Request
from kata.device.references import MAX_MESSAGE_BYTES, Packed, Reference, unpack

log = logging.getLogger(__name__)

CHECK_LIMIT_S: Final = 30.0
"""Longest time that the builder may take for an answer. For 3.8 hours at 100 Hz it needs 6 s on two cores of a server."""
_BUILDER: Final = (sys.executable, "-m", "kata.device.reference_builder")
_ANSWER: Final = msgspec.msgpack.Decoder(Packed | Refusal)

_NOT_CHECKED: Final = Refusal.of(
    code="unplayable",
    message=texts.CHECKING_PROGRAM_FAILED(),
    next_step=texts.LOAD_RECORDING_AGAIN(),
)

Result = Reference | Refusal


class ReferenceLoader:
    """Owns one builder process, which it restarts if it has ended, and the thread that talks to it. It handles one Load at a
    time.
    """

    def __init__(
        self, config: StationConfig, *, command: Sequence[str] = _BUILDER, limit_s: float = CHECK_LIMIT_S
    ) -> None:
        """Start the builder. Call this before the process requests real-time scheduling.

        :param command: starts a builder; the descriptor of its socket is appended.
        :param limit_s: longest time that the builder may take for an answer.
        """
        self._config = config
        self._command = command
        self._limit_s = limit_s
        self._builder: _Builder | None = _Builder(config, command, limit_s)
        self._loading: int | None = None
        """Id of the Load whose parts are sent to the builder."""
        self._messages: SimpleQueue[Request | LoadPart | None] = SimpleQueue()
        self._results: deque[tuple[int, Result]] = deque()
        self._newest: Result | None = None
        """Keeps a reference to the last result, so that the control thread is never the thread that frees the memory of an hour
        of samples.
        """
        self._ending = False
        self._thread = threading.Thread(target=self._serve, name="loader", daemon=True)
        self._notify: Callable[[], None] = lambda: None

    def start(self, notify: Callable[[], None]) -> None:
        """Start the thread. It calls ``notify`` after each result."""
        self._notify = notify
        self._thread.start()

    def finish(self) -> None:
        """End the thread and kill the builder, even while they handle a Load."""
        self._ending = True
        self._messages.put(None)
        if builder := self._builder:
            builder.kill()
        if self._thread.ident is not None:
            self._thread.join()
        self._end_builder()

    # -- called by the I/O thread ---------------------------------------------------------------------------------

    def send(self, message: Request | LoadPart) -> None:
        """Pass on a Request with a Load, or a part of a Load; never waits. The last part produces a result."""
        self._messages.put(message)

    def results(self) -> Iterator[tuple[int, Result]]:
        """Yield each new result: the request id with its reference or refusal."""
        while self._results:
            yield self._results.popleft()

    # -- in the loader's thread -----------------------------------------------------------------------------------

    def _serve(self) -> None:
        while (message := self._messages.get()) is not None and not self._ending:
            if isinstance(message, Request):
                self._loading, self._newest = message.id, None
            if message.id == self._loading:
                self._advance(message)

    def _advance(self, message: Request | LoadPart) -> None:
        try:
            result = self._pass_on(message)
        except Exception:
            log.exception("the reference builder has failed and is restarted")
            self._end_builder()
            result = _NOT_CHECKED
        if result:
            self._loading, self._newest = None, result
            self._results.append((message.id, result))
            self._notify()

    def _pass_on(self, message: Request | LoadPart) -> Result | None:
        """Send one message to the builder. After the last part, wait for the answer and return it.

        :raises OSError: when the builder has ended or takes too long.
        """
        if isinstance(message, Request) and self._builder and self._builder.has_ended:
            self._end_builder()
        self._builder = builder = self._builder or _Builder(self._config, self._command, self._limit_s)
        builder.send(msgspec.msgpack.encode(message))
        return builder.receive() if isinstance(message, LoadPart) and message.last else None

    def _end_builder(self) -> None:
        builder, self._builder = self._builder, None
        if builder:
            builder.kill()
            builder.close()


class _Builder:
    """A builder process and the socket that connects to it."""

    def __init__(self, config: StationConfig, command: Sequence[str], limit_s: float) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [*command, str(theirs.fileno())], stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
            )
        self._socket.settimeout(limit_s)
        self.send(msgspec.msgpack.encode(config))

    @property
    def has_ended(self) -> bool:
        return self._process.poll() is not None

    def send(self, data: bytes) -> None:
        self._socket.send(data)

    def receive(self) -> Result:
        data, descriptors, _, _ = socket.recv_fds(self._socket, MAX_MESSAGE_BYTES, 1)
        try:
            if not data:
                raise ConnectionError("the reference builder has ended")
            answer = _ANSWER.decode(data)
            return answer if isinstance(answer, Refusal) else unpack(answer, descriptors[0])
        finally:
            for descriptor in descriptors:
                os.close(descriptor)

    def kill(self) -> None:
        self._process.kill()

    def close(self) -> None:
        self._socket.close()
        self._process.wait()
