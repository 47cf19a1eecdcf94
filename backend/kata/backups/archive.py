"""The file format of a backup: a compressed tar, encrypted with age. ``age --decrypt -i KEY FILE | tar xz`` opens it without Kata.

The tar contains ``kata-backup.json`` with a description, ``database`` (a SQLite file or an archive of ``pg_dump``), and ``data/`` with the
clinic's other files. age authenticates every part and the end of the file, so a truncated or changed file is refused.
"""

import gzip
import os
import shutil
import tarfile
import threading
from collections.abc import Callable
from datetime import datetime
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import IO, Any, Final
from uuid import UUID

import msgspec
import pyrage
from pyrage.x25519 import Identity, Recipient

from kata.backups.catalogue import Kind
from kata.backups.key import BackupError
from kata.database.database_copy import DatabaseKind
from kata.database.table_checksums import TableChecksum
from kata.system.sync import sync_folder

SUFFIX: Final = ".kata-backup"
DATABASE: Final = "database"
DATA: Final = "data"
ANCHOR: Final = "audit.anchor"
FACTOR_KEY: Final = "second-factor-key.txt"
_CONTENTS_FILE: Final = "kata-backup.json"
_FORMAT: Final = "kata-backup/1"
_COMPRESSION_LEVEL: Final = 1
"""The fastest level, because samples are already compressed and text compresses well at any level."""
_NO_KEY_FITS: Final = "No matching keys found"


class Contents(msgspec.Struct, frozen=True, kw_only=True):
    """The description of a backup's contents."""

    format: str = _FORMAT
    id: UUID
    kind: Kind
    made_at: datetime
    program: str
    """Version of Kata that made the backup."""
    bytes: int
    """Size of the unpacked contents in bytes."""
    database: DatabaseKind
    schema: str
    """Revision of the database schema."""
    tables: dict[str, TableChecksum]
    """Row count and checksum of each table at the time of the backup."""
    anchored: int = 0
    """Number of lines in the audit trail's anchor when the backup began."""


def write_archive(file: Path, recipients: list[Recipient], contents: Contents, folder: Path) -> int:
    """Write the database copy and ``data/`` of ``folder`` into a new file for these recipients, and return its size in bytes.

    The file has a temporary name until it is complete and synced.

    :raises OSError: when the file cannot be written, for example because the disk is full.
    """
    part = file.with_name(file.name + ".part")
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as target:
            _through_pipe(
                lambda sink: _pack(sink, contents, folder),
                lambda source: pyrage.encrypt_io(source, target, recipients),
            )
            target.flush()
            os.fsync(target.fileno())
        size = part.stat().st_size
        part.rename(file)
    finally:
        part.unlink(missing_ok=True)
    sync_folder(file.parent)
    return size


def read_archive(file: Path, keys: list[Identity], folder: Path, check: Callable[[Contents], None]) -> Contents:
    """Extract everything into ``folder``. ``check`` may raise before the data is extracted.

    :raises BackupError: when no key fits, or the file is truncated, changed, of a newer version or not a backup.
    """
    contents: list[Contents] = []

    def unpack(source: IO[bytes]) -> None:
        contents.append(_unpack(source, folder, check))
        while source.read(1 << 16):
            # Read to the end, because only the end of the file proves that it is complete.
            pass

    try:
        with file.open("rb") as opened:
            _through_pipe(lambda sink: pyrage.decrypt_io(opened, sink, keys), unpack)
    except pyrage.DecryptError as error:
        if str(error) == _NO_KEY_FITS:
            raise BackupError(
                f"this key does not open {file}: the backup was made with another key, or its beginning is damaged. "
                "Use the key with which it was made, or another copy of the file"
            ) from error
        raise BackupError(
            f"{file} is not a backup, or its beginning is damaged; use another copy of the file, or another backup"
        ) from error
    except OSError as error:
        if error.errno is not None:
            raise BackupError(f"{file} cannot be extracted: {error.strerror}") from error
        raise _incomplete_error(file) from error
    except (tarfile.TarError, EOFError) as error:
        raise _incomplete_error(file) from error
    return contents[0]


def _incomplete_error(file: Path) -> BackupError:
    return BackupError(
        f"{file} is not complete: it was truncated or changed. Use another copy of the file, or another backup"
    )


def _pack(sink: IO[bytes], contents: Contents, folder: Path) -> None:
    with (
        gzip.GzipFile(fileobj=sink, mode="wb", filename="", compresslevel=_COMPRESSION_LEVEL) as packed,
        tarfile.open(fileobj=packed, mode="w|") as tar,
    ):
        description = msgspec.json.format(msgspec.json.encode(contents))
        head = tarfile.TarInfo(_CONTENTS_FILE)
        head.size, head.mtime, head.mode = len(description), int(contents.made_at.timestamp()), 0o600
        tar.addfile(head, BytesIO(description))
        tar.add(folder / DATABASE, DATABASE)
        tar.add(folder / DATA, DATA)


def _unpack(source: IO[bytes], folder: Path, check: Callable[[Contents], None]) -> Contents:
    with tarfile.open(fileobj=source, mode="r|gz") as tar:
        head = tar.next()
        opened = tar.extractfile(head) if head and head.name == _CONTENTS_FILE else None
        if opened is None:
            raise BackupError("this file is not a backup of Kata")
        contents = _parse_contents(opened.read())
        check(contents)
        while member := tar.next():
            _extract(tar, member, folder)
    return contents


def _extract(tar: tarfile.TarFile, member: tarfile.TarInfo, folder: Path) -> None:
    """Extract a file or a folder. Refuse other types and paths outside ``folder``, because anyone with the public key can make a valid
    archive.
    """
    path = PurePosixPath(member.name)
    if path.is_absolute() or ".." in path.parts or not (member.isdir() or member.isfile()):
        raise BackupError(f"this file is not a backup of Kata: {member.name}")
    target = folder / path
    if member.isdir():
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    opened = tar.extractfile(member)
    assert opened is not None
    mode = member.mode & 0o600
    with opened, os.fdopen(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as output:
        shutil.copyfileobj(opened, output)
        output.flush()
        os.fsync(output.fileno())


def _parse_contents(description: bytes) -> Contents:
    try:
        file_format = msgspec.json.decode(description, type=dict[str, Any]).get("format", "")
        if file_format == _FORMAT:
            return msgspec.json.decode(description, type=Contents)
    except msgspec.MsgspecError as error:
        raise BackupError("Kata cannot read the description in this backup") from error
    raise BackupError(
        f"this backup was made by a newer version of Kata (its format is {file_format!r}); install that version, then restore"
    )


def _through_pipe(fill: Callable[[IO[bytes]], None], drain: Callable[[IO[bytes]], None]) -> None:
    """Run ``fill`` in a thread and ``drain`` in this one, connected by a pipe. Raise the first error."""
    reading, writing = os.pipe()
    errors: list[BaseException] = []

    def filling() -> None:
        try:
            with os.fdopen(writing, "wb") as sink:
                fill(sink)
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=filling, name="backup")
    thread.start()
    try:
        with os.fdopen(reading, "rb") as source:
            drain(source)
    except BaseException as error:
        thread.join()
        # An error of ``fill`` is the cause; ``drain`` then only met an early end. A broken pipe in ``fill`` is the consequence of an error
        # of ``drain``.
        if errors and not isinstance(errors[0], BrokenPipeError):
            raise errors[0] from error
        raise
    thread.join()
    if errors:
        raise errors[0]
