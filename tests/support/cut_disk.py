"""A disk whose power can be cut: it records every write and sync and returns what may remain.

It guarantees no more than POSIX: a name remains after a sync of its folder, bytes after a sync of their file. Any part of later writes
may remain. A block of a grown file that never reached the disk has zeros or its earlier content.
"""

import errno
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from kata.device.journal import JournalDisk

_BLOCK: Final = 512


@dataclass
class CutDisk(JournalDisk):
    """Holds one file. The test moves ``now_ns``; a sync takes ``sync_ns``, during which ``meanwhile`` is called."""

    sync_ns: int = 0
    meanwhile: Callable[[int], None] = lambda until_ns: None
    most_at_once: int = 1 << 20
    room: int = 1 << 40
    tried: int = 10
    """Length of the unsynced part after each operation."""
    now_ns: int = 0
    data: bytearray = field(default_factory=bytearray)
    created: bool = False
    entered: bool = False
    synced: int = 0
    """Bytes of completed syncs."""
    failing: set[str] = field(default_factory=set)
    """Operations that fail once with an input/output error."""
    moments: list[tuple[int, int, int, bool, bool]] = field(default_factory=list)
    """After each operation: time, synced bytes, written bytes, whether the file exists, and whether it must exist."""

    def create(self, path: Path) -> int:
        self._may_fail("create")
        self.created = True
        self._note()
        return 7

    def write(self, file: int, data: bytearray) -> int:
        self._may_fail("write")
        count = min(len(data), self.most_at_once, self.room)
        if not count:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.room -= count
        self.data += data[:count]
        self._note()
        return count

    def sync(self, file: int) -> None:
        covered = len(self.data)
        self._pass(self.sync_ns)
        self._may_fail("sync")
        self.synced = covered
        self._note()

    def sync_folder(self, folder: Path) -> None:
        self._pass(self.sync_ns)
        self._may_fail("sync_folder")
        self.entered = True
        self._note()

    def close(self, file: int) -> None:
        self._note()

    def _pass(self, span_ns: int) -> None:
        until_ns = self.now_ns + span_ns
        self.meanwhile(until_ns)
        self.now_ns = until_ns

    def _may_fail(self, what: str) -> None:
        if what in self.failing:
            self.failing.remove(what)
            raise OSError(errno.EIO, "Input/output error")

    def _note(self) -> None:
        self.moments.append((self.now_ns, self.synced, len(self.data), self.created, self.entered))

    def states(self, stale: bytes = b"") -> Iterator[tuple[int, bytes | None]]:
        """Yield every legal state after each operation: the last time at which it is possible, and the file, None for no file.

        ``stale``: the disk's earlier content, of which whole blocks may reappear.
        """
        chance = random.Random(0)
        ends = [moment[0] for moment in self.moments[1:]] + [self.now_ns]
        for (_, synced, written, created, entered), end_ns in zip(self.moments, ends, strict=True):
            if not entered:
                yield end_ns, None
            if created:
                for data in self._contents(synced, written, chance, stale):
                    yield end_ns, data

    def _contents(self, synced: int, written: int, chance: random.Random, stale: bytes) -> Iterator[bytes]:
        """Yield the possible contents of the file; a sample of the lengths if there are many."""
        whole = bytes(self.data[:written])
        lengths = range(synced, written + 1)
        if len(lengths) > self.tried:
            lengths_tried = {synced, synced + 1, written - 1, written, *chance.sample(lengths, self.tried)}
        else:
            lengths_tried = set(lengths)
        for length in lengths_tried:
            missing = written - length
            yield whole[:length]
            yield whole[:length] + bytes(missing)
            yield whole[:length] + chance.randbytes(missing)
        # Blocks reach the disk in any order: an unwritten block has its earlier content, later blocks may be new.
        for block in range(synced // _BLOCK, -(-written // _BLOCK)):
            begin, end = max(synced, block * _BLOCK), min(written, (block + 1) * _BLOCK)
            for old in (bytes(end - begin), stale[begin:end].ljust(end - begin, b"\0")):
                yield whole[:begin] + old + whole[end:]
        if stale:
            yield whole[:synced] + stale[synced:written]
