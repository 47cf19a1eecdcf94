"""The pseudo-terminal's drive side: what is written into it reaches the drives in its time, and so do their answers."""

import contextlib
import fcntl
import heapq
import os
import struct
import time
import tty
from pathlib import Path
from typing import Final

from kata.simulator.answers import bytes_s
from kata.simulator.lines import Line
from kata.simulator.script import Script

_GET_TERMIOS_2: Final = 0x802C542A
"""TCGETS2: unlike termios it tells the rate as a number, also when it was set as one (as libraries in Rust do)."""
_TERMIOS_2: Final = struct.Struct("@4I20s2I")
"""Four sets of flags, line discipline and control characters, input and output rate."""


class Wire:
    """Found under one path for ever, as a serial adapter is by its id, even when it was pulled out in between."""

    def __init__(self, line: Line, script: Script, path: Path) -> None:
        """``path`` becomes a link to the pseudo-terminal."""
        self._line = line
        self._script = script
        self._path = path
        self._fd: int | None = None
        self._slave = -1
        self._going: list[tuple[int, int, bytes]] = []
        self._order = 0
        self._plug_in()

    @property
    def sources(self) -> list[int]:
        """What to wait for."""
        return [] if self._fd is None else [self._fd]

    @property
    def due_ns(self) -> int | None:
        """When something has to be done."""
        going = self._going[0][0] if self._going else None
        return min((due for due in (going, self._line.due_ns) if due is not None), default=None)

    def receive(self) -> None:
        """Bytes have come."""
        if self._fd is None:
            return
        with contextlib.suppress(BlockingIOError):
            data = os.read(self._fd, 4096)
            now_ns = time.monotonic_ns()
            baud = _baud(self._slave)
            if self._script.has("echo"):
                self._send_at(now_ns + (int(bytes_s(len(data), baud) * 1e9) if baud else 0), data)
            self._line.hear(data, now_ns, baud)

    def serve(self, now_ns: int) -> None:
        """Carry out and send what is due."""
        for at_ns, answer in self._line.carry_out(now_ns):
            self._send_at(at_ns + int(answer.after_s * 1e9), answer.data)
        while self._going and self._going[0][0] <= now_ns:
            _, _, data = heapq.heappop(self._going)
            if self._fd is not None:
                # Nobody reads: the bytes are lost, as on a real wire.
                with contextlib.suppress(BlockingIOError):
                    os.write(self._fd, data)
        if self._script.has("gone") != (self._fd is None):
            self._plug_in() if self._fd is None else self._pull_out()

    def close(self) -> None:
        """Leave no link behind."""
        if self._fd is not None:
            self._pull_out()

    def _send_at(self, due_ns: int, data: bytes) -> None:
        self._order += 1
        heapq.heappush(self._going, (due_ns, self._order, data))

    def _plug_in(self) -> None:
        self._fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._fd, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(self._slave))

    def _pull_out(self) -> None:
        assert self._fd is not None
        self._path.unlink(missing_ok=True)
        os.close(self._slave)
        os.close(self._fd)
        self._fd = None
        self._going.clear()


def _baud(terminal: int) -> int:
    """Bits a second that have been set, 0 when none were."""
    told = fcntl.ioctl(terminal, _GET_TERMIOS_2, bytes(_TERMIOS_2.size))
    return int(_TERMIOS_2.unpack(told)[5])
