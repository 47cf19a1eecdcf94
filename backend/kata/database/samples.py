"""Store series of samples in tables: one row for the head and one for each block, so that a window needs only its own blocks."""

from dataclasses import dataclass
from typing import Any
from uuid import UUID

from sqlalchemy import LargeBinary, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from kata.database.arrays import UnreadableError
from kata.database.series import Series, numbers_within


class SamplesColumns:
    """Columns of a table with one row per series. Its primary key identifies the recording or run."""

    data: Mapped[bytes] = mapped_column(LargeBinary)
    """The head (:mod:`kata.database.series`). In an old series without blocks: all samples (:mod:`kata.database.arrays`)."""
    overview: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    """Downsampled lines for a plot of the whole series; None if the series is so short that its samples can be plotted."""


class SampleBlockColumns:
    """Columns of a table with one row per block. Together with the key of the series, ``number`` is its primary key."""

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    data: Mapped[bytes] = mapped_column(LargeBinary)


@dataclass(frozen=True)
class SampleTables:
    """The tables of one kind of series. ``key``: the column of both tables that identifies a series."""

    heads: type[Any]
    blocks: type[Any]
    key: str

    def store(self, session: Session, key: UUID, series: Series, overview: bytes | None) -> None:
        """Store a new series. The recording or run must exist."""
        session.add(self.heads(data=series.head, overview=overview, **{self.key: key}))
        session.flush()
        rows = [self.blocks(number=number, data=data, **{self.key: key}) for number, data in series.blocks.items()]
        session.add_all(rows)

    def read(self, session: Session, key: UUID) -> Series:
        """Return the whole series; empty if there is none."""
        return self._read_blocks(session, key, self._read_head(session, key), None)

    def read_within(self, session: Session, key: UUID, clock: str, start_s: float, end_s: float) -> Series:
        """Return the head and the blocks that overlap a window. If the head is damaged, return no blocks.

        :param clock: name of the column of seconds to which the window refers.
        """
        head = self._read_head(session, key)
        try:
            numbers = numbers_within(head, clock, start_s, end_s)
        except UnreadableError:
            numbers = []
        return self._read_blocks(session, key, head, numbers)

    def read_overview(self, session: Session, key: UUID) -> bytes | None:
        """Return the overview of a series, or None if it has none."""
        is_series = getattr(self.heads, self.key) == key
        overview: bytes | None = session.scalar(select(self.heads.overview).where(is_series))
        return overview

    def _read_head(self, session: Session, key: UUID) -> bytes:
        row = session.get(self.heads, key)
        return row.data if row else b""

    def _read_blocks(self, session: Session, key: UUID, head: bytes, numbers: list[int] | None) -> Series:
        query = select(self.blocks.number, self.blocks.data).where(getattr(self.blocks, self.key) == key)
        if numbers is not None:
            query = query.where(self.blocks.number.in_(numbers))
        return Series(head, {row.number: row.data for row in session.execute(query)})
