"""``python -m kata.access.backups``: ``kata backup``, without loading what only the rest of the program needs."""

import typer

from kata.access.backups.commands import backup

typer.run(backup)
