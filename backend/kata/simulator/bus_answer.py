"""Defines a drive's answer and the transmission time of bytes."""

from typing import Final

from msgspec import Struct

_BITS_A_BYTE: Final = 10


class BusAnswer(Struct, frozen=True):
    """The bytes of an answer, and the time in seconds from the end of the request to the end of the last byte."""

    data: bytes
    after_s: float


def transmission_s(count: int, baud: int) -> float:
    """Return the transmission time of a number of bytes, in seconds."""
    return count * _BITS_A_BYTE / baud
