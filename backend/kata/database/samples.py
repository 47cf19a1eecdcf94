"""Series of samples in tables: a row for what is in them and one for each block, so that a window loads no more than it needs."""

from dataclasses import dataclass
from typing import Any
from uuid import UUID

from sqlalchemy import LargeBinary, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from kata.database.arrays import UnreadableError
from kata.database.series import Series, numbers_within


class SamplesColumns:
    """Of a table with a row a series; its primary key names whose it is."""

    data: Mapped[bytes] = mapped_column(LargeBinary)
    """The head (:mod:`kata.database.series`); of before there were blocks, everything (:mod:`kata.database.arrays`)."""
    overview: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    """What a plot of it all shows, made when it was kept; None where it is short enough to be looked at as it is."""


class SampleBlockColumns:
    """Of a table with a row a block; the rest of its primary key is that of the series."""

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    data: Mapped[bytes] = mapped_column(LargeBinary)


@dataclass(frozen=True)
class SampleTables:
    """Where series of one kind are: ``key`` is the column, in both tables, that says whose."""

    heads: type[Any]
    blocks: type[Any]
    key: str

    def keep(self, session: Session, key: UUID, series: Series, overview: bytes | None) -> None:
        """Write a new one down; whose it is must be there."""
        session.add(self.heads(data=series.head, overview=overview, **{self.key: key}))
        session.flush()
        rows = [self.blocks(number=number, data=data, **{self.key: key}) for number, data in series.blocks.items()]
        session.add_all(rows)

    def read(self, session: Session, key: UUID) -> Series:
        """All of it; empty when there is none."""
        return self._with_blocks(session, key, self._head(session, key), None)

    def read_within(self, session: Session, key: UUID, clock: str, start_s: float, end_s: float) -> Series:
        """The blocks that cover some of a window, by one of its columns of seconds; of a damaged head none."""
        head = self._head(session, key)
        try:
            numbers = numbers_within(head, clock, start_s, end_s)
        except UnreadableError:
            numbers = []
        return self._with_blocks(session, key, head, numbers)

    def overview(self, session: Session, key: UUID) -> bytes | None:
        """Its overview, where it has one."""
        mine = getattr(self.heads, self.key) == key
        overview: bytes | None = session.scalar(select(self.heads.overview).where(mine))
        return overview

    def _head(self, session: Session, key: UUID) -> bytes:
        row = session.get(self.heads, key)
        return row.data if row else b""

    def _with_blocks(self, session: Session, key: UUID, head: bytes, numbers: list[int] | None) -> Series:
        query = select(self.blocks.number, self.blocks.data).where(getattr(self.blocks, self.key) == key)
        if numbers is not None:
            query = query.where(self.blocks.number.in_(numbers))
        return Series(head, {row.number: row.data for row in session.execute(query)})
