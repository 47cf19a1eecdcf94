"""The file of a backup: a tar, compressed, inside an age file. ``age --decrypt -i KEY FILE | tar xz`` opens it without Kata.

First in it is ``kata-backup.json``, which says what the rest is; then ``database``, a SQLite file or an archive of ``pg_dump``; then
``data/``, what else belongs to the clinic. age authenticates every piece of it, and its end: what is cut short or changed is refused.
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

from kata.backups.book import Kind
from kata.backups.key import BackupError
from kata.database.database_copy import DatabaseKind
from kata.database.table_checksums import Tally

SUFFIX: Final = ".kata-backup"
DATABASE: Final = "database"
DATA: Final = "data"
ANCHOR: Final = "audit.anchor"
FACTOR_KEY: Final = "second-factor-key.txt"
_CONTENTS: Final = "kata-backup.json"
_FORMAT: Final = "kata-backup/1"
_COMPRESSION: Final = 1
"""Samples are compressed already; rows of text become small by any effort."""
_NO_KEY_FITS: Final = "No matching keys found"


class Contents(msgspec.Struct, frozen=True, kw_only=True):
    """What is in a backup."""

    format: str = _FORMAT
    id: UUID
    kind: Kind
    made_at: datetime
    program: str
    """Kata's version."""
    bytes: int
    """Of what is in it, unpacked."""
    database: DatabaseKind
    schema: str
    """Revision of the database's tables."""
    tables: dict[str, Tally]
    """What was in them at the moment of the backup."""
    anchored: int = 0
    """Lines in the audit trail's anchor when the backup was begun."""


def seal(file: Path, recipients: list[Recipient], contents: Contents, folder: Path) -> int:
    """Put ``folder`` (the database's copy and ``data/``) into a new file for these recipients: how many bytes it has.

    It is whole and on the disk under its name, or not there.

    :raises OSError: when there is no room, say.
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


def unseal(file: Path, keys: list[Identity], folder: Path, check: Callable[[Contents], None]) -> Contents:
    """Take everything out into ``folder``; ``check`` may refuse by raising, before the rest is taken out.

    :raises BackupError: when no key fits, or the file is cut short, changed, of a newer version or something else.
    """
    found: list[Contents] = []

    def unpack(source: IO[bytes]) -> None:
        found.append(_unpack(source, folder, check))
        while source.read(1 << 16):
            # To its very end: only there is it known to be whole.
            pass

    try:
        with file.open("rb") as opened:
            _through_pipe(lambda sink: pyrage.decrypt_io(opened, sink, keys), unpack)
    except pyrage.DecryptError as error:
        if str(error) == _NO_KEY_FITS:
            raise BackupError(
                f"this key does not open {file}: it was made with another one, or its first lines are damaged. "
                "Look for the key that was kept when it was made, or take another copy of the file"
            ) from error
        raise BackupError(
            f"{file} is no backup, or its beginning is damaged; take another copy of it, or another backup"
        ) from error
    except OSError as error:
        if error.errno is not None:
            raise BackupError(f"{file} cannot be taken apart: {error.strerror}") from error
        raise _not_whole(file) from error
    except (tarfile.TarError, EOFError) as error:
        raise _not_whole(file) from error
    return found[0]


def sync_folder(folder: Path) -> None:
    """Wait until the names in it survive a power cut."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _not_whole(file: Path) -> BackupError:
    return BackupError(f"{file} is not whole: it was cut short or changed. Take another copy of it, or another backup")


def _pack(sink: IO[bytes], contents: Contents, folder: Path) -> None:
    with (
        gzip.GzipFile(fileobj=sink, mode="wb", filename="", compresslevel=_COMPRESSION) as packed,
        tarfile.open(fileobj=packed, mode="w|") as tar,
    ):
        told = msgspec.json.format(msgspec.json.encode(contents))
        head = tarfile.TarInfo(_CONTENTS)
        head.size, head.mtime, head.mode = len(told), int(contents.made_at.timestamp()), 0o600
        tar.addfile(head, BytesIO(told))
        tar.add(folder / DATABASE, DATABASE)
        tar.add(folder / DATA, DATA)


def _unpack(source: IO[bytes], folder: Path, check: Callable[[Contents], None]) -> Contents:
    with tarfile.open(fileobj=source, mode="r|gz") as tar:
        head = tar.next()
        opened = tar.extractfile(head) if head and head.name == _CONTENTS else None
        if opened is None:
            raise BackupError("what is in this file is no backup of Kata")
        contents = _contents(opened.read())
        check(contents)
        while member := tar.next():
            _take_out(tar, member, folder)
    return contents


def _take_out(tar: tarfile.TarFile, member: tarfile.TarInfo, folder: Path) -> None:
    """Files and folders only, and none outside: a public key is enough to make a file that opens."""
    path = PurePosixPath(member.name)
    if path.is_absolute() or ".." in path.parts or not (member.isdir() or member.isfile()):
        raise BackupError(f"what is in this file is no backup of Kata: {member.name}")
    target = folder / path
    if member.isdir():
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    opened = tar.extractfile(member)
    assert opened is not None
    mode = member.mode & 0o600
    with opened, os.fdopen(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as written:
        shutil.copyfileobj(opened, written)
        written.flush()
        os.fsync(written.fileno())


def _contents(told: bytes) -> Contents:
    try:
        form = msgspec.json.decode(told, type=dict[str, Any]).get("format", "")
        if form == _FORMAT:
            return msgspec.json.decode(told, type=Contents)
    except msgspec.MsgspecError as error:
        raise BackupError("what is in this file is no backup that Kata can read") from error
    raise BackupError(
        f"this backup was made by a newer version of Kata (its format is {form!r}); install that version, then restore"
    )


def _through_pipe(fill: Callable[[IO[bytes]], None], drain: Callable[[IO[bytes]], None]) -> None:
    """Both at once, what the one writes being what the other reads; raises what went wrong first."""
    reading, writing = os.pipe()
    wrong: list[BaseException] = []

    def filling() -> None:
        try:
            with os.fdopen(writing, "wb") as sink:
                fill(sink)
        except BaseException as error:
            wrong.append(error)

    thread = threading.Thread(target=filling, name="backup")
    thread.start()
    try:
        with os.fdopen(reading, "rb") as source:
            drain(source)
    except BaseException as error:
        thread.join()
        # When the one that fills broke off, the other has met nothing but an end too soon; when it was hung up on, the other did.
        if wrong and not isinstance(wrong[0], BrokenPipeError):
            raise wrong[0] from error
        raise
    thread.join()
    if wrong:
        raise wrong[0]
