"""``kata backup`` and ``kata restore``. They import their modules when they run."""

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
    from kata.backups.restore import VerifiedBackup

_NICENESS: Final = 10
_EXIT_AFTER_SIGTERM: Final = 143

_DataOption = Annotated[Path | None, typer.Option(help="Folder for database and journals.")]


def backup(
    data: _DataOption = None,
    to: Annotated[Path | None, typer.Option(help="Folder for the backup. Default: KATA_BACKUP_DIR.")] = None,
    nightly: Annotated[bool, typer.Option("--nightly", hidden=True)] = False,
) -> None:
    """Make and verify an encrypted backup; Kata may be running. The exit status is 1 if this fails or the audit trail is not intact."""
    from kata.backups.create import create_backup
    from kata.backups.key import BackupError

    settings = _settings_from(data=data, backup_dir=to)
    # The backup is not urgent and must not delay the control loop.
    os.nice(_NICENESS)
    # Exiting removes files that are not encrypted yet.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(_EXIT_AFTER_SIGTERM))
    try:
        record = create_backup(settings, "nightly" if nightly else "asked")
    except BackupError as error:
        fail(str(error))
    typer.echo(f"Backup: {record.file} ({record.bytes / 1e6:.1f} MB)")
    if record.tested_at is None:
        typer.echo(f"Not verified: {record.test_problem}")
    elif record.test_problem:
        fail(f"The backup cannot be restored completely: {record.test_problem}")
    else:
        typer.echo("Verified by a trial restore: complete, and equal to the database at the time of the backup.")
        _print_audit_result(record.audit_rows, record.audit_problem)
    if settings.backup_key_file.exists():
        typer.echo(
            f"Key: {settings.backup_key_file}. The backup cannot be opened without it; keep a copy on another computer or on paper."
        )


def restore(
    file: Annotated[Path, typer.Argument(help="The backup.", exists=True, dir_okay=False)],
    key: Annotated[
        Path | None, typer.Option(help="The key that opens the backup. Default: the key in the data folder.")
    ] = None,
    data: _DataOption = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="Only verify that the backup can be restored. Kata may be running.")
    ] = False,
    former_try: Annotated[bool, typer.Option("--try", hidden=True)] = False,
) -> None:
    """Restore the clinic from a backup. Stop Kata first. The present data is moved to another folder, not overwritten."""
    from kata.backups.key import BackupError
    from kata.backups.restore import restore_backup, verify_and_record
    from kata.database.engine import DatabaseError

    # Hide the messages of the database upgrade.
    logging.basicConfig(level=logging.WARNING)
    if former_try:
        typer.echo("--try is now called --verify; the next release does not accept --try.", err=True)
    settings = _settings_from(data=data)
    key_file = key or settings.backup_key_file
    try:
        if verify or former_try:
            _print_trial(verify_and_record(settings, file, key_file))
            return
        restored = restore_backup(settings, file, key_file)
    except (BackupError, DatabaseError) as error:
        fail(_as_sentence(error))
    except OSError as error:
        fail(f"{error.strerror}: {error.filename}.")
    typer.echo(
        f"The clinic in {settings.data} is restored to its state on {restored.contents.made_at:%Y-%m-%d %H:%M} UTC."
    )
    typer.echo(f"Previous data: {restored.aside}")
    typer.echo(
        "All users must sign in again, with the passwords that they had at that time. Start the service: kata serve"
    )


def _print_trial(verified: "VerifiedBackup") -> None:
    contents = verified.contents
    if verified.problems:
        fail(f"The backup cannot be restored completely: {'; '.join(verified.problems)}.")
    rows = sum(table.rows for table in contents.tables.values())
    typer.echo(
        f"Complete: made on {contents.made_at:%Y-%m-%d %H:%M} UTC by Kata {contents.program}, {len(contents.tables)} tables, "
        f"{rows} rows, equal to the database at that time. Nothing was changed."
    )
    _print_audit_result(verified.audit_rows, verified.audit_problem)


def _print_audit_result(rows: int | None, problem: str) -> None:
    if problem:
        fail(f"The audit trail in the backup is NOT INTACT: {problem} For all findings: kata audit verify")
    typer.echo(
        "The backup contains no audit trail."
        if rows is None
        else f"The audit trail in the backup is intact: {rows} rows."
    )


def _settings_from(**options: Any) -> Settings:
    return Settings(**{name: value for name, value in options.items() if value is not None})


def _as_sentence(error: Exception) -> str:
    message = str(error)
    return f"{message[:1].upper()}{message[1:]}" + ("" if message.endswith(".") else ".")
