"""A serial line through pyserial, with deadlines worked out from bytes and baud rate."""

import contextlib
import select
import time

import serial

from kata.device.bus.port import BusError

_BITS_A_BYTE = 10
_SLACK_NS = 4_000_000
"""For adapter, driver and scheduler, on top of the bytes' own time."""


class SerialLine:
    """One open port, owned by one process (``exclusive``)."""

    def __init__(self, port: str, baud: int) -> None:
        """:raises BusError: when the port cannot be opened."""
        self._port = port
        self._byte_ns = _BITS_A_BYTE * 1_000_000_000 // baud
        try:
            self._serial = serial.Serial(port, baud, timeout=0, write_timeout=0.1, exclusive=True)
        except (OSError, ValueError) as error:
            raise BusError(f"{port} cannot be opened: {error}") from error
        # A USB adapter that keeps replies back for 16 ms would cost a cycle. Not every port can be asked.
        with contextlib.suppress(OSError, ValueError, NotImplementedError):
            self._serial.set_low_latency_mode(True)

    def deadline_ns(self, sent: int, expected: int, waits_ns: int) -> int:
        """When the last of ``expected`` bytes must be here, if ``sent`` bytes leave now and devices wait ``waits_ns``."""
        return time.monotonic_ns() + (sent + expected) * self._byte_ns + waits_ns + _SLACK_NS

    def send(self, data: bytes) -> None:
        """Forget what came late, and send. :raises BusError: when the port is gone."""
        try:
            self._serial.reset_input_buffer()
            self._serial.write(data)
        except OSError as error:
            raise BusError(f"{self._port} is gone: {error}") from error

    def receive(self, deadline_ns: int) -> bytes:
        """What has come, waiting for a first byte until the deadline; empty when none came.

        :raises BusError: when the port is gone.
        """
        left_s = (deadline_ns - time.monotonic_ns()) / 1e9
        try:
            ready, _, _ = select.select([self._serial.fileno()], [], [], max(left_s, 0.0))
            return bytes(self._serial.read(4096)) if ready else b""
        except (OSError, ValueError, TypeError) as error:
            raise BusError(f"{self._port} is gone: {error}") from error

    def close(self) -> None:
        """Close the port."""
        with contextlib.suppress(OSError):
            self._serial.close()
