"""The ports of the simulated apparatus: a pseudo-terminal for any program, and a socket for Kata's own device process."""

import fcntl
import os
import socket
import struct
import sys
import tty
from pathlib import Path
from typing import Final, Protocol

_GET_TERMIOS_2: Final = 0x802C542A
"""TCGETS2. Unlike termios it returns the rate as a number, even if the rate was set as a number (as Rust libraries do)."""
_TERMIOS_2: Final = struct.Struct("@4I20s2I")
"""Format of four sets of flags, line discipline and control characters, and input and output rate."""
_AT_ONCE: Final = 4096
_BAUD_BYTES: Final = 4


class Port(Protocol):
    """The drives' end of an open port."""

    @property
    def sources(self) -> list[int]:
        """The file descriptors to wait for."""

    @property
    def baud(self) -> int:
        """The baud rate that the other end has set; 0 if none is set."""

    def read(self) -> bytes:
        """Return the received bytes.

        :raises BlockingIOError: when there are none.
        """

    def write(self, data: bytes) -> None:
        """Send bytes.

        :raises BlockingIOError: when the other end reads nothing.
        """

    def close(self) -> None:
        """Close the port and remove its path."""


class TerminalPort:
    """A pseudo-terminal, which any program opens like a serial port."""

    def __init__(self, path: Path) -> None:
        """Open it. ``path`` becomes a link to it."""
        self._path = path
        self._fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._fd, False)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(self._slave))

    @property
    def sources(self) -> list[int]:
        """See :class:`Port`."""
        return [self._fd]

    @property
    def baud(self) -> int:
        """See :class:`Port`."""
        settings = fcntl.ioctl(self._slave, _GET_TERMIOS_2, bytes(_TERMIOS_2.size))
        return int(_TERMIOS_2.unpack(settings)[5])

    def read(self) -> bytes:
        """See :class:`Port`."""
        return os.read(self._fd, _AT_ONCE)

    def write(self, data: bytes) -> None:
        """See :class:`Port`."""
        os.write(self._fd, data)

    def close(self) -> None:
        """See :class:`Port`."""
        self._path.unlink(missing_ok=True)
        os.close(self._slave)
        os.close(self._fd)


class SocketPort:
    """A socket for one connection at a time. No kernel worker delivers its bytes, so they are punctual on a busy computer, too."""

    def __init__(self, path: Path) -> None:
        """Listen at ``path``."""
        self._path = path
        path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._listener.setblocking(False)
        self._connection: socket.socket | None = None
        self._received = b""
        """The received part of the baud rate."""
        self.baud = 0

    @property
    def sources(self) -> list[int]:
        """See :class:`Port`."""
        return [self._listener.fileno(), *([self._connection.fileno()] if self._connection else [])]

    def read(self) -> bytes:
        """Return the received bytes. Accept a connection if none is open, and hang up on a second one.

        :raises BlockingIOError: when there are none.
        """
        data = self._read_connection()
        if data is None:
            self._accept()
            raise BlockingIOError
        return data

    def write(self, data: bytes) -> None:
        """See :class:`Port`. Without a connection the bytes are lost."""
        if self._connection is None:
            return
        try:
            self._connection.send(data)
        except ConnectionError:
            self._hang_up()

    def close(self) -> None:
        """See :class:`Port`."""
        self._hang_up()
        self._path.unlink(missing_ok=True)
        self._listener.close()

    def _read_connection(self) -> bytes | None:
        """Return what the connection has sent after its baud rate, or None if there is nothing."""
        if self._connection is None:
            return None
        try:
            data = self._connection.recv(_AT_ONCE)
        except BlockingIOError:
            return None
        except ConnectionError:
            data = b""
        if not data:
            self._hang_up()
            return None
        if not self.baud:
            self._received += data
            if len(self._received) < _BAUD_BYTES:
                return None
            self.baud = int.from_bytes(self._received[:_BAUD_BYTES], sys.byteorder)
            data, self._received = self._received[_BAUD_BYTES:], b""
        return data or None

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except BlockingIOError:
            return
        if self._connection:
            connection.close()
            return
        connection.setblocking(False)
        self._connection = connection

    def _hang_up(self) -> None:
        if self._connection:
            self._connection.close()
        self._connection, self.baud, self._received = None, 0, b""
