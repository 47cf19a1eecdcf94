"""Numbers as pages and reports show them, and their changes."""

from decimal import ROUND_HALF_UP, Decimal
from functools import lru_cache
from typing import Final

_STEPS: Final = tuple(Decimal(1).scaleb(-digits) for digits in range(7))
"""Smallest step of a number with 0, 1, 2, … decimals."""


def as_shown(value: float, digits: int = 1) -> float:
    """Return a number with these decimals. Half a step is rounded up as in a browser: 44.25 is 44.3, where Python's formats show 44.2."""
    return float(_shown(value, digits))


def change_as_shown(first: float, last: float, digits: int = 1) -> float:
    """Return the change from one number to another: the difference of the numbers as they are shown.

    A reader who subtracts 79.8 from 44.1 expects −35.7, although the exact difference may be −35.62.
    """
    return float(_shown(last, digits) - _shown(first, digits))


# Scores and angles of thousands of patients are few different numbers.
@lru_cache(maxsize=4096)
def _shown(value: float, digits: int) -> Decimal:
    return Decimal(value).quantize(_STEPS[digits], ROUND_HALF_UP)
