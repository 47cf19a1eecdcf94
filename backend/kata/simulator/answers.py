"""What a bus gives back to the wire, and how long bytes take on it."""

from typing import Final

from msgspec import Struct

_BITS_A_BYTE: Final = 10


class Answer(Struct, frozen=True):
    """Bytes, and how long after the request was heard the last of them is out, in seconds."""

    data: bytes
    after_s: float


def bytes_s(count: int, baud: int) -> float:
    """So many bytes' time on the wire."""
    return count * _BITS_A_BYTE / baud
