"""A serial port of the drive maker's own library that waits for an answer even on a busy computer."""

from collections.abc import Iterator
from contextlib import contextmanager

from dynamixel_sdk import PortHandler

ANSWER_WITHIN_MS = 500.0


class _Port(PortHandler):  # type: ignore[misc]  # The library has no types.
    """Waits longer than the library's 34 ms, for which a busy computer can keep the simulated drives from running."""

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802 - The library's name.
        super().setPacketTimeout(packet_length)
        self.packet_timeout += ANSWER_WITHIN_MS


@contextmanager
def open_port(path: str, baud: int = 1_000_000) -> Iterator[PortHandler]:
    """Open a serial line at `baud` with the maker's library."""
    opened = _Port(path)
    assert opened.openPort()
    assert opened.setBaudRate(baud)
    try:
        yield opened
    finally:
        opened.closePort()
