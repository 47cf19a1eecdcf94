"""The spool: records on disk that wait for the database, in append-only files of up to 256 KiB.

A file has a header line of JSON, followed by records. A record consists of length, CRC-32 and payload. All records before the first
truncated or damaged one are
valid. The CRC continues from the header, so a block of another file counts as damaged. Records are numbered from 1 without gaps over all
files of a folder. The database stores the number of the last delivered record (:class:`kata.database.delivery.Delivery`).
"""

import logging
import os
import struct
import threading
import zlib
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Final
from uuid import UUID, uuid4

import msgspec

from kata.database.base import utc_now
from kata.system.sync import sync_folder

log = logging.getLogger(__name__)

SUFFIX: Final = ".spool"
_FRAME: Final = struct.Struct("<II")
_MAX_PAYLOAD_BYTES: Final = 1 << 20
"""Largest payload in bytes. A larger length means that the file is damaged."""
_MAX_FILE_BYTES: Final = 256 << 10
"""Size after which the next file begins. Each read of new records reads a whole file."""
_MAX_WAITING: Final = 10_000
"""Maximum number of records that wait in memory while the disk is full. They take a few megabytes."""
_RETRY_S: Final = 1.0


class SpoolError(Exception):
    """A file of the folder is not a spool file. The message names it."""


class Header(msgspec.Struct, frozen=True, tag_field="format", tag="kata-spool/1"):
    """First line of a file."""

    id: UUID
    """Id of the spool. Every file of a folder has the same id."""
    first: int
    """Number of the file's first record."""


@dataclass(frozen=True, slots=True)
class Record:
    """A record and its number."""

    number: int
    payload: bytes


@dataclass(frozen=True, slots=True)
class Part:
    """The valid content of a file."""

    header: Header
    records: Sequence[Record]
    end: int
    """Position of the end of the last valid record, in bytes."""
    crc: int
    """CRC of the content up to ``end``."""


def read(path: Path) -> Part | None:
    """Return the valid content of a file, or None if its header is incomplete.

    :raises SpoolError: when the file has another format or version.
    """
    data = path.read_bytes()
    line, newline, _ = data.partition(b"\n")
    if not newline:
        return None
    try:
        header = msgspec.json.decode(line, type=Header)
    except msgspec.MsgspecError as error:
        raise SpoolError(f"this version cannot read the spool file {path}: {error}") from error
    at, crc = len(line) + 1, zlib.crc32(line)
    records: list[Record] = []
    while at + _FRAME.size <= len(data):
        length, stored_crc = _FRAME.unpack_from(data, at)
        payload = data[at + _FRAME.size : at + _FRAME.size + length]
        next_crc = zlib.crc32(payload, crc)
        if length > _MAX_PAYLOAD_BYTES or len(payload) < length or next_crc != stored_crc:
            break
        records.append(Record(header.first + len(records), payload))
        at, crc = at + _FRAME.size + length, next_crc
    return Part(header, records, at, crc)


class Spool:
    """The spool of one folder. :meth:`put` never waits; a thread writes and syncs the records."""

    def __init__(self, folder: Path, *, max_file_bytes: int = _MAX_FILE_BYTES, retry_s: float = _RETRY_S) -> None:
        """Open the folder and continue after the last valid record.

        :param max_file_bytes: size of a file after which the next one begins.
        :param retry_s: pause before a retry after the disk refused a write.
        :raises SpoolError: when a file of the folder cannot be read.
        :raises OSError: when the folder cannot be written to.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self._max_file_bytes, self._retry_s = folder, max_file_bytes, retry_s
        self._changed = threading.Condition()
        self._waiting: deque[bytes] = deque()
        self._full_since: datetime | None = None
        self._dropped = 0
        self._closing = False
        self._woken = False
        self._file = -1
        self.id, self.last = self._find_last()
        self.last_at_start = self.last
        """Number of the last record at the start."""
        self._open_file(self.last + 1)
        self._thread = threading.Thread(target=self._run, name="spool", daemon=True)
        self._thread.start()

    @property
    def full_since(self) -> datetime | None:
        """Return the time (UTC) since which the disk refuses records, or None if it accepts them."""
        return self._full_since

    @property
    def unwritten(self) -> int:
        """Return the number of records that are not on disk yet."""
        return len(self._waiting)

    def put(self, payload: bytes) -> None:
        """Add a record after all others."""
        with self._changed:
            if self._closing or len(self._waiting) >= _MAX_WAITING:
                self._dropped += 1
                log.critical("the disk refuses records; this record is lost: %r", payload)
                return
            self._waiting.append(payload)
            self._changed.notify_all()

    def until_more(self, number: int, limit_s: float) -> bool:
        """Wait for a record after this number. Return False if none is on disk after ``limit_s`` seconds, or after :meth:`wake`."""
        with self._changed:
            self._changed.wait_for(lambda: self.last > number or self._woken or self._closing, limit_s)
            return self.last > number

    def wake(self) -> None:
        """End the present and every future wait of :meth:`until_more`."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def until_written(self, limit_s: float) -> bool:
        """Wait until all records put so far are on disk. Return False if that takes longer than ``limit_s`` seconds."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting, limit_s)

    def after(self, number: int, limit: int) -> list[Record]:
        """Return at most ``limit`` records after this number, in order."""
        records: list[Record] = []
        last = self.last
        files = self._list_files()
        for path, following in zip(files, [*files[1:], None], strict=True):
            # The next file contains the records from its first number on again.
            end = min(last, _first_number(following) - 1) if following else last
            if len(records) < limit and end > number and (part := read(path)):
                records += [record for record in part.records if number < record.number <= end]
        return records[:limit]

    def delete_up_to(self, number: int) -> None:
        """Delete the files that contain only records up to this number, because the database has them."""
        files = self._list_files()
        for path, following in pairwise(files):
            if _first_number(following) <= number + 1:
                path.unlink()

    def close(self) -> None:
        """Write the waiting records if the disk accepts them, and end the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        os.close(self._file)

    def _find_last(self) -> tuple[UUID, int]:
        id_, last = uuid4(), 0
        for path in self._list_files():
            part = read(path)
            if part is None:
                # The computer failed while the header was being written, so the file has no records.
                path.unlink()
                continue
            id_, last = part.header.id, part.header.first + len(part.records) - 1
        return id_, last

    def _open_file(self, first: int) -> None:
        """Open a new file whose first record has this number. An older file is never continued, because its end may be damaged."""
        path = self.folder / f"{first:012d}{SUFFIX}"
        line = msgspec.json.encode(Header(self.id, first))
        file = os.open(path, os.O_CREAT | os.O_TRUNC | os.O_WRONLY | os.O_APPEND, 0o600)
        try:
            os.write(file, line + b"\n")
            os.fsync(file)
            sync_folder(self.folder)
        except OSError:
            os.close(file)
            raise
        if self._file >= 0:
            os.close(self._file)
        self._file, self._size, self._crc = file, len(line) + 1, zlib.crc32(line)

    def _list_files(self) -> list[Path]:
        return sorted(self.folder.glob(f"*{SUFFIX}"))

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closing)
                batch = list(self._waiting)
                if not batch:
                    return
            try:
                self._write_batch(batch)
            except OSError as error:
                if self._full_since is None:
                    log.critical("the disk refuses the station's records: %s", error)
                self._full_since = self._full_since or utc_now()
                with self._changed:
                    if self._closing:
                        log.critical("the disk refuses records; these records are lost: %s", batch)
                        return
                    self._changed.wait_for(lambda: self._closing, self._retry_s)
                continue
            if self._full_since:
                log.error("the disk accepts the station's records again; %d records were lost", self._dropped)
                self._full_since, self._dropped = None, 0
            with self._changed:
                for _ in batch:
                    self._waiting.popleft()
                self.last += len(batch)
                self._changed.notify_all()

    def _write_batch(self, batch: Sequence[bytes]) -> None:
        if self._size >= self._max_file_bytes:
            self._open_file(self.last + 1)
        framed, crc = bytearray(), self._crc
        for payload in batch:
            crc = zlib.crc32(payload, crc)
            framed += _FRAME.pack(len(payload), crc) + payload
        try:
            written_bytes = os.write(self._file, framed)
            if written_bytes < len(framed):
                raise OSError(f"the disk has accepted {written_bytes} of {len(framed)} bytes")
            os.fdatasync(self._file)
        except OSError:
            # Remove the partial write, so that the retry does not store records twice. The retry opens another file.
            size, self._size = self._size, self._max_file_bytes
            os.ftruncate(self._file, size)
            raise
        self._size, self._crc = self._size + len(framed), crc


def _first_number(path: Path) -> int:
    return int(path.stem)
