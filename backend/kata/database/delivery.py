"""From the spool into the database: in order, exactly once, tried until it is there."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Final
from uuid import UUID

from sqlalchemy import BigInteger, String, select
from sqlalchemy.exc import OperationalError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as NoConnectionError
from sqlalchemy.orm import Mapped, Session, mapped_column

from kata.database.availability import DatabaseUnavailableError
from kata.database.base import Base, UtcDateTime, utc_now
from kata.database.engine import Database
from kata.database.spool import Record, Spool

log = logging.getLogger(__name__)

_AT_ONCE: Final = 500
AGAIN_S: Final = 1.0
_LONGEST_S: Final = 10.0
"""Between two tries."""
_REFUSED: Final = "refused.jsonl"


class SpoolRow(Base):
    """How far the database has taken a station's spool: written in the transaction that takes it, and nowhere else."""

    __tablename__ = "spools"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    taken: Mapped[int] = mapped_column(BigInteger)
    """Number of the last record that stands in the database."""
    at: Mapped[datetime] = mapped_column(UtcDateTime)


class Delivery:
    """A thread that brings what is in the spool into the database.

    Whatever of it a crash, or a connection that broke in the commit, leaves undecided is decided by the row of the spool, which is
    locked, read and written with what is taken.
    """

    def __init__(
        self,
        spool: Spool,
        database: Database,
        station: str,
        take: Callable[[Session, Sequence[Record]], int],
        folder: Path,
        *,
        again_s: float = AGAIN_S,
        each_round: Callable[[], None] = lambda: None,
    ) -> None:
        """``take`` writes some records, in a session that it does not commit, and says how many of the first it has written.

        ``folder``: where is kept what the database refuses for itself. ``again_s``: the first pause before it is tried again; each
        is twice the one before. ``each_round``: done between two looks, at least once in ``again_s``.
        """
        self._spool, self._database, self._station, self._take = spool, database, station, take
        self._refused, self._again_s, self.each_round = folder / _REFUSED, again_s, each_round
        self._changed = threading.Condition()
        self._taken: int | None = None
        self._closing = False
        self._gives_up_s = float("inf")
        self._thread = threading.Thread(target=self._run, name="delivery", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """How many records the database does not have yet, as far as is known."""
        return self._spool.unwritten + self._spool.last - (self._taken or 0)

    def until_taken(self, limit_s: float) -> bool:
        """Whether the database has, within so many seconds, all that has been put into the spool so far."""
        until = time.monotonic() + limit_s
        if not self._spool.until_written(limit_s):
            return False
        last = self._spool.last
        with self._changed:
            return self._changed.wait_for(
                lambda: self._taken is not None and self._taken >= last, max(0.0, until - time.monotonic())
            )

    def close(self, limit_s: float) -> None:
        """End the thread when all is taken, or at the first failure after this, or after so many seconds: what is left stays on disk."""
        with self._changed:
            self._closing, self._gives_up_s = True, time.monotonic() + limit_s
            self._changed.notify_all()
        self._spool.let_go()
        self._thread.join()
        if left := self.waiting:
            log.warning("%d records of the spool are left for the next start", left)

    def _run(self) -> None:
        pause_s = self._again_s
        while True:
            try:
                if self._taken is None:
                    self._find()
                while self._spool.last > (self._taken or 0):
                    self._deliver(_AT_ONCE)
                pause_s = self._again_s
                self.each_round()
                if self._closing and not self._spool.unwritten:
                    return
                self._spool.until_more(self._taken or 0, 0.0 if self._closing else self._again_s)
                continue
            except (OperationalError, NoConnectionError, DatabaseUnavailableError) as error:
                log.info("the spool waits for the database: %s", error)
            except Exception:
                log.exception("the spool could not be read or brought into the database")
            with self._changed:
                if self._closing:
                    return
                self._changed.wait_for(lambda: self._closing, pause_s)
            pause_s = min(2 * pause_s, _LONGEST_S)
            if monitor := self._database.monitor:
                monitor.until_back(pause_s)

    def _find(self) -> None:
        """Where it goes on; the spool's row is made where there is none."""
        with self._database.write() as session:
            row = session.get(SpoolRow, self._spool.id)
            if row is None:
                row = SpoolRow(id=self._spool.id, station=self._station, taken=0, at=utc_now())
                session.add(row)
            # A folder that was put back to an older state goes on with numbers that have been taken before.
            taken = row.taken = min(row.taken, self._spool.found)
        self._now_taken(taken)

    def _deliver(self, at_once: int) -> None:
        try:
            with self._database.write() as session:
                row = session.scalars(select(SpoolRow).where(SpoolRow.id == self._spool.id).with_for_update()).one()
                last = self._spool.last
                records = self._spool.after(row.taken, at_once)
                count = self._take(session, records) if records else 0
                # What a damaged file does not tell is behind us, too.
                row.taken = records[count - 1].number if records else last
                row.at = utc_now()
                session.flush()
                taken = row.taken
        except (OperationalError, NoConnectionError, DatabaseUnavailableError):
            raise
        except (SQLAlchemyError, ValueError) as error:
            if at_once > 1:
                # One of them is refused: the others are not to wait behind it.
                for _ in range(at_once):
                    if self._spool.last > (self._taken or 0):
                        self._deliver(1)
                return
            taken = self._set_aside(error)
        self._now_taken(taken)

    def _set_aside(self, error: Exception) -> int:
        """What the database refuses for itself stands in a file, for whoever looks after it; the others go on."""
        with self._database.write() as session:
            row = session.scalars(select(SpoolRow).where(SpoolRow.id == self._spool.id).with_for_update()).one()
            (record,) = self._spool.after(row.taken, 1)
            log.error("the database refuses record %d; it is kept in %s", record.number, self._refused, exc_info=error)
            with self._refused.open("ab") as file:
                file.write(record.payload + b"\n")
            row.taken, row.at = record.number, utc_now()
            return record.number

    def _now_taken(self, number: int) -> None:
        with self._changed:
            self._taken = number
            self._changed.notify_all()
        self._spool.taken(number)
