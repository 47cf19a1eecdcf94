"""What a command says on the terminal, beside its output."""

import sys
from typing import Final, NoReturn

from rich.console import Console

console: Final = Console(stderr=True, highlight=False)


def fail(message: str, status: int = 1) -> NoReturn:
    """Say what is wrong, as it is: paths have brackets, and are not to be cut in two. Ends with this status."""
    console.print(message, style="bold red", markup=False, soft_wrap=True)
    sys.exit(status)
