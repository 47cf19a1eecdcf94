"""Timing of a serial line."""

from typing import Final

BITS_A_BYTE: Final = 10
"""Eight data bits, one start bit and one stop bit."""
