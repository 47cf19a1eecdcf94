"""``python -m kata.backups``: ``kata backup``, without loading what only the rest of the program needs."""

import typer

from kata.backups.commands import backup

typer.run(backup)
