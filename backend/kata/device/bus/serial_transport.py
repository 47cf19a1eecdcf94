"""The transports of a driver, with a time limit on every call: a serial port through pyserial, and the simulated apparatus' socket."""

import contextlib
import fcntl
import logging
import os
import select
import socket
import sys
import termios
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

import serial
from serial.rs485 import RS485Settings

from kata.device import texts
from kata.device.bus.adapter import SameAdapter, UsbAdapter, connected_adapters
from kata.device.bus.interface import BusError
from kata.device.bus.timing import RtsDirection

if TYPE_CHECKING:
    from kata.device.config import StationConfig

log = logging.getLogger(__name__)

_WAKE_BEFORE_NS: Final = 300_000
"""Sleep until this long before the last byte can arrive. Waking for every packet of a slow bus would use a third of a core.
"""


class Transport(Protocol):
    """Sends and receives bytes, with one clock for both."""

    def now_ns(self) -> int:
        """Return the current time of the clock used for deadlines and answers."""

    def send(self, data: bytes) -> None:
        """Discard late input, then send. Do not wait until the bytes are transmitted.

        :raises BusError: when the port is gone.
        """

    def receive(self, earliest_ns: int, deadline_ns: int) -> bytes:
        """Return the received bytes. Wait for a first byte until the deadline; return nothing if none arrives.

        ``earliest_ns``: the earliest time at which all expected bytes can have arrived; it is unnecessary to check much earlier.

        :raises BusError: when the port is gone.
        """

    def close(self) -> None:
        """Close the port."""


class _OpenedTransport:
    """Sends and receives through a file descriptor that does not block."""

    def __init__(self, port: str, fd: int) -> None:
        self._port = port
        self._fd = fd

    def now_ns(self) -> int:
        """See :class:`Transport`."""
        return time.monotonic_ns()

    def send(self, data: bytes) -> None:
        """See :class:`Transport`."""
        try:
            self._discard_input()
            if os.write(self._fd, data) != len(data):
                raise BusError(texts.PORT_TAKES_NOTHING(port=self._port))
        except OSError as error:
            raise BusError(texts.PORT_GONE(port=self._port, error=error)) from error

    def receive(self, earliest_ns: int, deadline_ns: int) -> bytes:
        """See :class:`Transport`."""
        if (early_ns := earliest_ns - _WAKE_BEFORE_NS - time.monotonic_ns()) > _WAKE_BEFORE_NS:
            time.sleep(early_ns / 1e9)
        left_s = (deadline_ns - time.monotonic_ns()) / 1e9
        try:
            ready, _, _ = select.select([self._fd], [], [], max(left_s, 0.0))
            data = os.read(self._fd, 4096) if ready else None
        except (OSError, ValueError) as error:
            raise BusError(texts.PORT_GONE(port=self._port, error=error)) from error
        if data == b"":
            raise BusError(texts.PORT_HUNG_UP(port=self._port))
        return data or b""

    def _discard_input(self) -> None:
        """Discard the bytes in the port's buffer.

        Unlike ``tcflush`` and unlike an empty read, this does not wait for the kernel worker that delivers further bytes. On a
        busy computer that worker may not run for milliseconds. Bytes that it delivers later arrive too early for an answer and
        are therefore discarded.
        """
        count = bytearray(4)
        fcntl.ioctl(self._fd, termios.FIONREAD, count)
        if waiting := int.from_bytes(count, sys.byteorder):
            os.read(self._fd, waiting)


class SerialTransport(_OpenedTransport):
    """An open serial port that no other process can open (``exclusive``)."""

    def __init__(self, port: str, baud: int, rts_direction: RtsDirection = "off") -> None:
        """Open the port.

        :param rts_direction: see :class:`~kata.device.config.StationConfig`.
        :raises BusError: when the port cannot be opened, or the kernel cannot switch the adapter's direction.
        """
        try:
            self._serial = serial.Serial(port, baud, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError, termios.error) as error:
            raise BusError(texts.PORT_CANNOT_BE_OPENED(port=port, error=error)) from error
        super().__init__(port, self._serial.fileno())
        if rts_direction != "off":
            self._switch_by_rts(sends_high=rts_direction == "high")
        # A USB adapter that buffers answers for 16 ms would cost a cycle. Not every port supports this request.
        try:
            self._serial.set_low_latency_mode(True)
        except (OSError, ValueError, NotImplementedError):
            log.info("%s cannot be set to low latency; run kata doctor to see whether this matters", port)

    def close(self) -> None:
        """See :class:`Transport`."""
        with contextlib.suppress(OSError):
            self._serial.close()

    def _switch_by_rts(self, *, sends_high: bool) -> None:
        """Let the kernel switch the adapter's direction by RTS.

        :raises BusError: when the adapter's driver in the kernel cannot do this. The port is then closed.
        """
        try:
            self._serial.rs485_mode = RS485Settings(rts_level_for_tx=sends_high, rts_level_for_rx=not sends_high)
        except (OSError, ValueError, termios.error) as error:
            self.close()
            raise BusError(texts.RTS_DIRECTION_REFUSED(port=self._port, error=error)) from error


class SocketTransport(_OpenedTransport):
    """A connection to the simulated apparatus of ``kata serve --simulate``.

    A kernel worker of ordinary priority delivers the bytes of a pseudo-terminal, and on a busy computer it may not run for many
    cycles. The bytes of a socket arrive at once.
    """

    def __init__(self, port: str, baud: int) -> None:
        """Connect. The first four bytes tell the apparatus the baud rate, as a serial port's settings do.

        :raises BusError: when the simulator does not answer.
        """
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.connect(port)
            self._socket.sendall(baud.to_bytes(4, sys.byteorder))
        except OSError as error:
            self._socket.close()
            raise BusError(texts.PORT_CANNOT_BE_OPENED(port=port, error=error)) from error
        self._socket.setblocking(False)
        super().__init__(port, self._socket.fileno())

    def close(self) -> None:
        """See :class:`Transport`."""
        self._socket.close()


def open_port(port: str, baud: int, rts_direction: RtsDirection = "off") -> Transport:
    """Open a station's port: a serial port, or the socket of a simulated apparatus.

    :raises BusError: when the port cannot be opened.
    """
    return SocketTransport(port, baud) if Path(port).is_socket() else SerialTransport(port, baud, rts_direction)


def port_of(
    config: "StationConfig", connected: Callable[[], Sequence[UsbAdapter]] = connected_adapters
) -> Callable[[str, int], Transport]:
    """Return the function that opens a port for a station, with path and baud rate. It opens no other adapter than the first time.

    :param connected: returns the present adapters.
    """
    same_adapter = SameAdapter(connected)

    def open_same(port: str, baud: int) -> Transport:
        transport = open_port(port, baud, config.rts_direction)
        try:
            same_adapter.check(port)
        except BusError:
            transport.close()
            raise
        return transport

    return open_same
