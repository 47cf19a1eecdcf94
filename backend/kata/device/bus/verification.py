"""Records which blocks of configured registers have been verified on each drive, and selects the next block to read."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Final

_MISSES_BEFORE_REREAD: Final = 3
"""Consecutive misses after which a drive is read again. A busy computer may lose one or two answers, and a drive cannot be
exchanged or restarted within two cycles.
"""
_READ_ATTEMPTS: Final = 3
"""Maximum number of attempts to read a block whose answer is missing. A round reserves a fifth of its time for repeats."""
ROUND_S: Final = 2.0
"""Longest time between two reads of the same register: each round reads every configured register of every drive."""


@dataclass
class _Drive:
    """The verification state of one drive."""

    unread: set[int]
    """Blocks not yet read since the drive was configured or answered again."""
    misses: int = 0
    """Consecutive missing answers."""
    mismatches: dict[int, Sequence[str]] = field(default_factory=dict)
    """Names of the registers with an unexpected value, by block."""


def cycles_between_reads(reads: int, cycle_hz: int) -> int:
    """Return the number of cycles between two reads of the rotation, for ``reads`` reads in a round. The reads use only 80 % of
    the round, because missing answers are requested again.
    """
    return max(1, math.floor(0.8 * ROUND_S * cycle_hz / max(reads, 1)))


class Verification:
    """Schedules and records the reads of each drive's blocks. The first blocks are read with a drive's status, the others in rotation."""

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

        :param blocks: number of blocks of each drive, including those that come with a status.
        :param cycle_hz: maximum number of calls of :meth:`next_read` a second.
        :param urgent: drive and block that are read in every second read while they are unread.
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
        """Attempts made so far at the next read of the rotation."""
        self._unread_next = 0

    def forget(self, drive: int) -> None:
        """Mark all blocks of a drive as unread, because the drive may have been exchanged or was configured."""
        known = self._drives[drive]
        known.unread = set(range(self._blocks))
        known.mismatches.clear()

    def heard(self, drive: int, *, answered: bool) -> None:
        """Record whether the drive answered in this cycle. After several misses mark all its blocks as unread, because the drive
        may return with other settings.

        A known mismatch remains until the block is read.
        """
        known = self._drives[drive]
        known.misses = 0 if answered else known.misses + 1
        if known.misses == _MISSES_BEFORE_REREAD:
            known.unread = set(range(self._blocks))

    def next_read(self, *, replaces_status: bool = True) -> tuple[int, int] | None:
        """Return drive and block to read in this cycle, or None. If the read replaces a status read, at least every other call
        returns None.

        Unread blocks are read in turn, so that a block without an answer does not delay the others. Meanwhile the rotation
        continues. It repeats a read that was not answered.
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
        """Record that a block was read. ``mismatches``: names of its registers whose value differs from the configuration."""
        known = self._drives[drive]
        known.unread.discard(block)
        if self._rotation and (drive, block) == self._rotation[self._next]:
            self._move_on()
        if mismatches:
            known.mismatches[block] = mismatches
        else:
            known.mismatches.pop(block, None)

    def mismatch(self, drive: int) -> str:
        """Return the name of a register whose value differs from the configuration; empty if none is known."""
        return next((names[0] for names in self._drives[drive].mismatches.values()), "")

    def registers_match(self, drive: int, block: int, names: Collection[str]) -> bool:
        """Return True if the block has been read and its named registers have their configured values. Other registers may differ."""
        known = self._drives[drive]
        return block not in known.unread and not any(name in names for name in known.mismatches.get(block, ()))

    def verified(self, drive: int) -> bool:
        """Return True if every block has been read and every register has its configured value."""
        known = self._drives[drive]
        return not known.unread and not known.mismatches
