"""Tracks which blocks of configured registers have been verified on each drive, and selects the next block to read."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Final

_MISSES_BEFORE_REREAD: Final = 3
"""A busy computer loses an answer now and then; no drive is exchanged or restarted within two cycles."""
_READ_ATTEMPTS: Final = 3
"""Limits the attempts to read a block whose answer is missing. A round has a fifth of its time to spare for them."""
ROUND_S: Final = 2.0
"""Every configured register of every drive is read at least this often."""


@dataclass
class _Drive:
    """The verification state of one drive."""

    unread: set[int]
    """Blocks that have not been read since the drive was configured or reappeared."""
    misses: int = 0
    """Consecutive missing answers."""
    mismatches: dict[int, Sequence[str]] = field(default_factory=dict)
    """By block: the names of the registers with another value."""


def cycles_between_reads(reads: int, cycle_hz: int) -> int:
    """Return the cycles from one read of the rotation to the next: a little fewer than the round allows, because missing
    answers are requested again. ``reads``: of a whole round.
    """
    return max(1, math.floor(0.8 * ROUND_S * cycle_hz / max(reads, 1)))


class Verification:
    """Tracks ``drives`` times ``blocks`` reads. The first blocks come with a drive's status, the others in a rotation."""

    def __init__(
        self,
        drives: int,
        blocks: int,
        cycle_hz: int,
        urgent: tuple[int, int] | None = None,
        *,
        with_status: int = 1,
    ) -> None:
        """Prepare the rotation.

        :param blocks: those with the status included.
        :param cycle_hz: how often :meth:`next_read` is called a second, at most.
        :param urgent: drive and block that are read first while unread; the others take turns with them.
        :param with_status: number of blocks that come with a status.
        """
        self._urgent = urgent
        self._urgent_last = False
        """True if the last unread block requested was the urgent one."""
        self._blocks = blocks
        self._drives = [_Drive(set(range(blocks))) for _ in range(drives)]
        self._rotation = [(drive, block) for block in range(with_status, blocks) for drive in range(drives)]
        self._every = cycles_between_reads(len(self._rotation), cycle_hz)
        self._cycle = 0
        """Cycles since the last read of the rotation."""
        self._read_last = False
        """True if a block was read in the last cycle."""
        self._next = 0
        """Index in the rotation of the next read."""
        self._tries = 0
        """Attempts at that read."""
        self._unread_next = 0

    def forget(self, drive: int) -> None:
        """Read the whole drive again: it may be another drive, or it has been configured."""
        known = self._drives[drive]
        known.unread = set(range(self._blocks))
        known.mismatches.clear()

    def heard(self, drive: int, *, answered: bool) -> None:
        """Record whether the drive answered in this cycle. After some misses it may come back with other settings: read
        it all again.

        A known mismatch stays until the block is read.
        """
        known = self._drives[drive]
        known.misses = 0 if answered else known.misses + 1
        if known.misses == _MISSES_BEFORE_REREAD:
            known.unread = set(range(self._blocks))

    def next_read(self, *, replaces_status: bool = True) -> tuple[int, int] | None:
        """Return drive and block to read in this cycle; None for a status, at least every other cycle if the read
        replaces one.

        Unread blocks are read in turn: a block that is never answered does not delay the others. The rotation continues
        meanwhile and repeats a read that was not answered.
        """
        self._cycle += 1
        due = None
        if self._rotation and not (self._read_last and replaces_status):
            due = self._next_of_rotation() if self._cycle >= self._every else self._next_unread()
        self._read_last = due is not None
        return due

    def _next_of_rotation(self) -> tuple[int, int]:
        if self._tries == _READ_ATTEMPTS:
            self._move_on()
        self._tries += 1
        self._cycle = 0
        return self._rotation[self._next]

    def _move_on(self) -> None:
        self._next, self._tries = (self._next + 1) % len(self._rotation), 0

    def _next_unread(self) -> tuple[int, int] | None:
        self._urgent_last = self._urgent is not None and not self._urgent_last and self.is_unread(*self._urgent)
        return self._urgent if self._urgent_last else self._next_unread_in_turn()

    def is_unread(self, drive: int, block: int) -> bool:
        """Return True if a block is unread and its drive answers."""
        known = self._drives[drive]
        return block in known.unread and not known.misses

    def _next_unread_in_turn(self) -> tuple[int, int] | None:
        for step in range(len(self._rotation)):
            drive, block = place = self._rotation[(self._unread_next + step) % len(self._rotation)]
            if self.is_unread(drive, block):
                self._unread_next = (self._unread_next + step + 1) % len(self._rotation)
                return place
        return None

    def found(self, drive: int, block: int, mismatches: Sequence[str]) -> None:
        """Record a block that was read. ``mismatches``: names of the registers in it with another value than configured."""
        known = self._drives[drive]
        known.unread.discard(block)
        if self._rotation and (drive, block) == self._rotation[self._next]:
            self._move_on()
        if mismatches:
            known.mismatches[block] = mismatches
        else:
            known.mismatches.pop(block, None)

    def mismatch(self, drive: int) -> str:
        """Return the name of a register with another value than configured; empty if none is known."""
        return next((names[0] for names in self._drives[drive].mismatches.values()), "")

    def registers_match(self, drive: int, block: int, names: Collection[str]) -> bool:
        """Return True if the block has been read and the named registers in it have their values. Others may differ."""
        known = self._drives[drive]
        return block not in known.unread and not any(name in names for name in known.mismatches.get(block, ()))

    def verified(self, drive: int) -> bool:
        """Return True if every block has been read and every register has its value."""
        known = self._drives[drive]
        return not known.unread and not known.mismatches
