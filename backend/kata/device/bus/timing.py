"""Timing of a serial line."""

from typing import Final

BITS_A_BYTE: Final = 10
"""Eight data bits, a start bit and a stop bit."""
