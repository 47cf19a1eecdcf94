"""Timing of a serial line, and the direction of its adapter."""

from typing import Final, Literal

BITS_A_BYTE: Final = 10
"""Eight data bits, one start bit and one stop bit."""

RtsDirection = Literal["off", "high", "low"]
"""Level of RTS while Kata sends, see :class:`~kata.device.config.StationConfig`."""
