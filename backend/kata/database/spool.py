"""What has to reach the database, on disk before anything else: an append-only file of some hundred kilobytes, and the next.

A file is a header line of JSON, then records of length, CRC-32 and payload. It is valid at any byte: what stands before the first
record that is cut or damaged is good. The CRC goes on from the header, so that a block of another file is damaged here. Records are
numbered from 1 without gaps over all files of a folder; how far the database has taken them, it says itself
(:class:`kata.database.delivery.Delivery`).
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

log = logging.getLogger(__name__)

SUFFIX: Final = ".spool"
_FRAME: Final = struct.Struct("<II")
_LONGEST: Final = 1 << 20
"""Bytes of a payload: a length beyond that is damage."""
_FULL_BYTES: Final = 256 << 10
"""Then the next file begins: a file is read whole for each look at what is new in it."""
_MOST: Final = 10_000
"""So many may wait in memory, while the disk takes none; a few megabytes."""
_AGAIN_S: Final = 1.0


class SpoolError(Exception):
    """A file of the folder is none of ours; the message says which."""


class Header(msgspec.Struct, frozen=True, tag_field="format", tag="kata-spool/1"):
    """First line of a file."""

    id: UUID
    """Of the spool: the same in every file of a folder."""
    first: int
    """Number of its first record."""


@dataclass(frozen=True, slots=True)
class Record:
    """One of them."""

    number: int
    payload: bytes


@dataclass(frozen=True, slots=True)
class Part:
    """A file as it was found."""

    header: Header
    records: Sequence[Record]
    end: int
    """Where the last good one ends, in bytes."""
    crc: int
    """By then."""


def read(path: Path) -> Part | None:
    """A file, as far as it is whole; None where not even its header is.

    :raises SpoolError: when it is of another kind or version.
    """
    data = path.read_bytes()
    line, newline, _ = data.partition(b"\n")
    if not newline:
        return None
    try:
        header = msgspec.json.decode(line, type=Header)
    except msgspec.MsgspecError as error:
        raise SpoolError(f"{path} is no spool that this version can read: {error}") from error
    at, crc = len(line) + 1, zlib.crc32(line)
    records: list[Record] = []
    while at + _FRAME.size <= len(data):
        length, told = _FRAME.unpack_from(data, at)
        payload = data[at + _FRAME.size : at + _FRAME.size + length]
        crc_then = zlib.crc32(payload, crc)
        if length > _LONGEST or len(payload) < length or crc_then != told:
            break
        records.append(Record(header.first + len(records), payload))
        at, crc = at + _FRAME.size + length, crc_then
    return Part(header, records, at, crc)


class Spool:
    """One folder's. :meth:`put` waits for nothing; a thread writes at once, which outlives this process, and syncs."""

    def __init__(self, folder: Path, *, full_bytes: int = _FULL_BYTES, again_s: float = _AGAIN_S) -> None:
        """Goes on behind the last whole record. ``full_bytes``: when the next file begins; ``again_s``: the pause before a disk that
        took nothing is tried again.

        :raises SpoolError: when something in the folder cannot be read.
        :raises OSError: when the folder cannot be written to.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._folder, self._full_bytes, self._again_s = folder, full_bytes, again_s
        self._changed = threading.Condition()
        self._waiting: deque[bytes] = deque()
        self._full_since: datetime | None = None
        self._dropped = 0
        self._closing = False
        self._let_go = False
        self._file = -1
        self.id, self.last = self._found()
        self.found = self.last
        """Number of the last record that was there at the beginning."""
        self._open(self.last + 1)
        self._thread = threading.Thread(target=self._run, name="spool", daemon=True)
        self._thread.start()

    @property
    def full_since(self) -> datetime | None:
        """Since when the disk takes nothing, UTC; None: it does."""
        return self._full_since

    @property
    def unwritten(self) -> int:
        """How many are not on disk yet."""
        return len(self._waiting)

    def put(self, payload: bytes) -> None:
        """Have it kept, behind all that was put before."""
        with self._changed:
            if self._closing or len(self._waiting) >= _MOST:
                self._dropped += 1
                log.critical("this is not kept, as the disk takes nothing: %r", payload)
                return
            self._waiting.append(payload)
            self._changed.notify_all()

    def until_more(self, number: int, limit_s: float) -> bool:
        """Whether there is a record behind this number on disk within so many seconds; nobody waits after :meth:`let_go`."""
        with self._changed:
            self._changed.wait_for(lambda: self.last > number or self._let_go or self._closing, limit_s)
            return self.last > number

    def let_go(self) -> None:
        """Whoever waits for more is to look after its own end."""
        with self._changed:
            self._let_go = True
            self._changed.notify_all()

    def until_written(self, limit_s: float) -> bool:
        """Whether all that was put so far is on disk within so many seconds."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting, limit_s)

    def after(self, number: int, most: int) -> list[Record]:
        """The records behind this number, in order, no more than so many."""
        found: list[Record] = []
        last = self.last
        files = self._files()
        for path, following in zip(files, [*files[1:], None], strict=True):
            # What a file holds beyond the beginning of the next was given up there, and written anew.
            end = min(last, _first(following) - 1) if following else last
            if len(found) < most and end > number and (part := read(path)):
                found += [one for one in part.records if number < one.number <= end]
        return found[:most]

    def taken(self, number: int) -> None:
        """The database has everything up to this number: what holds nothing else is removed."""
        files = self._files()
        for path, following in pairwise(files):
            if _first(following) <= number + 1:
                path.unlink()

    def close(self) -> None:
        """Write what waits, as far as the disk takes it, and end the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        os.close(self._file)

    def _found(self) -> tuple[UUID, int]:
        id_, last = uuid4(), 0
        for path in self._files():
            part = read(path)
            if part is None:
                # Its header was being written when the computer went down: nothing stands in it.
                path.unlink()
                continue
            id_, last = part.header.id, part.header.first + len(part.records) - 1
        return id_, last

    def _open(self, first: int) -> None:
        """A new file, beginning with this number. One that was left is never written to again: its end may be damaged."""
        path = self._folder / f"{first:012d}{SUFFIX}"
        line = msgspec.json.encode(Header(self.id, first))
        file = os.open(path, os.O_CREAT | os.O_TRUNC | os.O_WRONLY | os.O_APPEND, 0o600)
        try:
            os.write(file, line + b"\n")
            os.fsync(file)
            _sync(self._folder)
        except OSError:
            os.close(file)
            raise
        if self._file >= 0:
            os.close(self._file)
        self._file, self._size, self._crc = file, len(line) + 1, zlib.crc32(line)

    def _files(self) -> list[Path]:
        return sorted(self._folder.glob(f"*{SUFFIX}"))

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closing)
                batch = list(self._waiting)
                if not batch:
                    return
            try:
                self._write(batch)
            except OSError as error:
                if self._full_since is None:
                    log.critical("what happens at the station is not kept: %s", error)
                self._full_since = self._full_since or utc_now()
                with self._changed:
                    if self._closing:
                        log.critical("these are not kept: %s", batch)
                        return
                    self._changed.wait_for(lambda: self._closing, self._again_s)
                continue
            if self._full_since:
                log.error("the disk takes what happens at the station again; %d were not kept", self._dropped)
                self._full_since, self._dropped = None, 0
            with self._changed:
                for _ in batch:
                    self._waiting.popleft()
                self.last += len(batch)
                self._changed.notify_all()

    def _write(self, batch: Sequence[bytes]) -> None:
        if self._size >= self._full_bytes:
            self._open(self.last + 1)
        framed, crc = bytearray(), self._crc
        for payload in batch:
            crc = zlib.crc32(payload, crc)
            framed += _FRAME.pack(len(payload), crc) + payload
        try:
            written = os.write(self._file, framed)
            if written < len(framed):
                raise OSError(f"the disk has taken {written} of {len(framed)} bytes")
            os.fdatasync(self._file)
        except OSError:
            # As it was, so that what is tried again stands there once; and then in another file, whatever becomes of this one.
            kept, self._size = self._size, self._full_bytes
            os.ftruncate(self._file, kept)
            raise
        self._size, self._crc = self._size + len(framed), crc


def _sync(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _first(path: Path) -> int:
    return int(path.stem)
