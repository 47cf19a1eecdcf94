"""``kata backup`` and ``kata restore``. What they take is imported when they are asked for."""

import logging
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from kata.settings import Settings
from kata.system.console import fail

if TYPE_CHECKING:
    from kata.backups.restoring import Tried

_PATIENCE: Final = 10
_TOLD_TO_END: Final = 143

_Data = Annotated[Path | None, typer.Option(help="Folder for database and journals.")]


def backup(
    data: _Data = None,
    to: Annotated[Path | None, typer.Option(help="Folder for backups, instead of the one that is set.")] = None,
    nightly: Annotated[bool, typer.Option("--nightly", hidden=True)] = False,
) -> None:
    """Make an encrypted backup now, also while Kata runs, and try it. Status 1 when there is none, it does not come
    back whole, or the audit trail in it is not.
    """
    from kata.backups.key import BackupError
    from kata.backups.making import make

    settings = _settings(data=data, backups=to)
    # Nobody waits for it, and a cycle of the apparatus shall not.
    os.nice(_PATIENCE)
    # Told to end, it takes away what is not encrypted yet.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(_TOLD_TO_END))
    try:
        note = make(settings, "nightly" if nightly else "asked")
    except BackupError as error:
        fail(str(error))
    typer.echo(f"Backup: {note.file} ({note.bytes / 1e6:.1f} MB)")
    if note.tested_at is None:
        typer.echo(f"Not tried: {note.test_problem}")
    elif note.test_problem:
        fail(f"It does not come back whole: {note.test_problem}")
    else:
        typer.echo("Restored to try it: whole, and equal to the database at its moment.")
        _tell_audit(note.audit_rows, note.audit_problem)
    if settings.backup_key_file.exists():
        typer.echo(
            f"Key: {settings.backup_key_file}. Without it the backup is worth nothing; a copy of it belongs elsewhere."
        )


def restore(
    file: Annotated[Path, typer.Argument(help="The backup.", exists=True, dir_okay=False)],
    key: Annotated[
        Path | None, typer.Option(help="The key that opens it; the one beside the data unless given.")
    ] = None,
    data: _Data = None,
    only_try: Annotated[
        bool, typer.Option("--try", help="Only see whether it can be restored; also while Kata runs.")
    ] = False,
) -> None:
    """Bring the clinic back from a backup. What is there now is put aside, not written over. Kata must not run meanwhile."""
    from kata.backups import restoring
    from kata.backups.key import BackupError
    from kata.database.engine import DatabaseError

    # What an upgrade of the restored tables says of itself is nobody's concern here.
    logging.basicConfig(level=logging.WARNING)
    settings = _settings(data=data)
    opens = key or settings.backup_key_file
    try:
        if only_try:
            _tell(restoring.try_and_note(settings, file, opens))
            return
        restored = restoring.restore(settings, file, opens)
    except (BackupError, DatabaseError) as error:
        fail(_sentence(error))
    except OSError as error:
        fail(f"{error.strerror}: {error.filename}.")
    typer.echo(f"The clinic is as it was on {restored.contents.made_at:%Y-%m-%d %H:%M} UTC, in {settings.data}.")
    typer.echo(f"What was there before: {restored.aside}")
    typer.echo("Everybody signs in again, with the passwords of that day. Start it: kata serve")


def _tell(tried: "Tried") -> None:
    told = tried.contents
    if tried.problems:
        fail(f"It does not come back whole: {'; '.join(tried.problems)}.")
    rows = sum(table.rows for table in told.tables.values())
    typer.echo(
        f"Whole: made on {told.made_at:%Y-%m-%d %H:%M} UTC by Kata {told.program}, {len(told.tables)} tables, {rows} rows, "
        "equal to the database at that moment. Nothing was changed."
    )
    _tell_audit(tried.audit_rows, tried.audit_problem)


def _tell_audit(rows: int | None, problem: str) -> None:
    if problem:
        fail(f"The audit trail in it is NOT WHOLE: {problem} Ask for all of it: kata audit verify")
    typer.echo("There is no audit trail in it." if rows is None else f"The audit trail in it is whole: {rows} rows.")


def _settings(**given: Any) -> Settings:
    return Settings(**{name: value for name, value in given.items() if value is not None})


def _sentence(error: Exception) -> str:
    told = str(error)
    return f"{told[:1].upper()}{told[1:]}" + ("" if told.endswith(".") else ".")
