"""Prints messages of a command on the terminal, in addition to its output."""

import sys
from typing import Final, NoReturn

from rich.console import Console

console: Final = Console(stderr=True, highlight=False)


def fail(message: str, status: int = 1) -> NoReturn:
    """Print an error without markup and line breaks (paths may contain brackets), and exit with this status."""
    console.print(message, style="bold red", markup=False, soft_wrap=True)
    sys.exit(status)
