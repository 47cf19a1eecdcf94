"""What the command says on the terminal, beside its output."""

import sys
from typing import Final, NoReturn

from rich.console import Console

from kata.access.set_up import LASTS

console: Final = Console(stderr=True, highlight=False)


def fail(message: str) -> NoReturn:
    """Say what is wrong, and end with status 1."""
    console.print(f"[bold red]{message}[/bold red]")
    sys.exit(1)


def print_set_up_link(url: str, secret: str) -> None:
    """To the terminal, never to the log: whoever reads it is let in."""
    hours = LASTS.total_seconds() / 3600
    console.print(
        f"Set up the clinic's administrator, once, within {hours:g} hours: {url}/set-up#secret={secret}", soft_wrap=True
    )
