"""``python -m kata.backups``: runs ``kata backup`` without importing the rest of the program."""

import typer

from kata.backups.commands import backup

typer.run(backup)
