"""Deliver records from the spool to the database: in order, exactly once, with retries."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from datetime import datetime
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

_BATCH_RECORDS: Final = 500
RETRY_S: Final = 1.0
_LONGEST_PAUSE_S: Final = 10.0
_REFUSED_FILE: Final = "refused.jsonl"


class SpoolRow(Base):
    """The position of a station's spool in the database. It is updated only in the transaction that stores the records."""

    __tablename__ = "spools"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    taken: Mapped[int] = mapped_column(BigInteger)
    """Number of the last record that the database has."""
    at: Mapped[datetime] = mapped_column(UtcDateTime)


class Delivery:
    """A thread that delivers the spool's records to the database.

    The spool's row is locked, read and written in the transaction that stores the records. After a crash, or after a connection was lost
    during the commit, the row shows which records have been stored.
    """

    def __init__(
        self,
        spool: Spool,
        database: Database,
        station: str,
        take: Callable[[Session, Sequence[Record]], int],
        *,
        retry_s: float = RETRY_S,
        each_round: Callable[[], None] = lambda: None,
    ) -> None:
        """Start the thread.

        :param take: stores the first of the given records without committing, and returns how many it has stored.
        :param retry_s: pause before the first retry. Each following pause is twice as long.
        :param each_round: called between two deliveries, at least every ``retry_s`` seconds.
        """
        self._spool, self._database, self._station, self._take = spool, database, station, take
        self._refused, self._retry_s, self.each_round = spool.folder / _REFUSED_FILE, retry_s, each_round
        self._changed = threading.Condition()
        self._delivered: int | None = None
        self._closing = False
        self._gives_up_s = float("inf")
        self._thread = threading.Thread(target=self._run, name="delivery", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Return the number of records that may not be in the database yet."""
        return self._spool.unwritten + self._spool.last - (self._delivered or 0)

    def until_taken(self, limit_s: float) -> bool:
        """Wait until the database has all records put so far. Return False if that takes longer than ``limit_s`` seconds."""
        until = time.monotonic() + limit_s
        if not self._spool.until_written(limit_s):
            return False
        last = self._spool.last
        with self._changed:
            return self._changed.wait_for(
                lambda: self._delivered is not None and self._delivered >= last, max(0.0, until - time.monotonic())
            )

    def close(self, limit_s: float) -> None:
        """End the thread when everything is delivered, at the first failure, or after ``limit_s`` seconds. Undelivered records stay on
        disk.
        """
        with self._changed:
            self._closing, self._gives_up_s = True, time.monotonic() + limit_s
            self._changed.notify_all()
        self._spool.wake()
        self._thread.join()
        if undelivered := self.waiting:
            log.warning("%d records of the spool are not delivered; the next start delivers them", undelivered)

    def _run(self) -> None:
        pause_s = self._retry_s
        while True:
            try:
                if self._delivered is None:
                    self._load_position()
                while self._spool.last > (self._delivered or 0):
                    self._deliver(_BATCH_RECORDS)
                pause_s = self._retry_s
                self.each_round()
                if self._closing and not self._spool.unwritten:
                    return
                self._spool.until_more(self._delivered or 0, 0.0 if self._closing else self._retry_s)
                continue
            except (OperationalError, NoConnectionError, DatabaseUnavailableError) as error:
                log.info("the spool waits for the database: %s", error)
            except Exception:
                log.exception("the spool could not be read or delivered")
            with self._changed:
                if self._closing:
                    return
                self._changed.wait_for(lambda: self._closing, pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
            if monitor := self._database.monitor:
                monitor.until_back(pause_s)

    def _load_position(self) -> None:
        """Read the position from the spool's row, or create that row."""
        with self._database.write() as session:
            row = session.get(SpoolRow, self._spool.id)
            if row is None:
                row = SpoolRow(id=self._spool.id, station=self._station, taken=0, at=utc_now())
                session.add(row)
            # A folder that was restored to an older state gives new records the numbers of delivered ones.
            delivered = row.taken = min(row.taken, self._spool.last_at_start)
        self._set_delivered(delivered)

    def _deliver(self, at_once: int) -> None:
        try:
            with self._database.write() as session:
                row = session.scalars(select(SpoolRow).where(SpoolRow.id == self._spool.id).with_for_update()).one()
                last = self._spool.last
                records = self._spool.after(row.taken, at_once)
                count = self._take(session, records) if records else 0
                # Records that are lost in a damaged file are skipped.
                row.taken = records[count - 1].number if records else last
                row.at = utc_now()
                session.flush()
                delivered = row.taken
        except (OperationalError, NoConnectionError, DatabaseUnavailableError):
            raise
        except (SQLAlchemyError, ValueError) as error:
            if at_once > 1:
                # The database refuses one record. Deliver the others one by one.
                for _ in range(at_once):
                    if self._spool.last > (self._delivered or 0):
                        self._deliver(1)
                return
            delivered = self._set_aside(error)
        self._set_delivered(delivered)

    def _set_aside(self, error: Exception) -> int:
        """Append a record that the database refuses to a file, and skip it."""
        with self._database.write() as session:
            row = session.scalars(select(SpoolRow).where(SpoolRow.id == self._spool.id).with_for_update()).one()
            (record,) = self._spool.after(row.taken, 1)
            log.error(
                "the database refuses record %d; it is stored in %s", record.number, self._refused, exc_info=error
            )
            with self._refused.open("ab") as file:
                file.write(record.payload + b"\n")
            row.taken, row.at = record.number, utc_now()
            return record.number

    def _set_delivered(self, number: int) -> None:
        with self._changed:
            self._delivered = number
            self._changed.notify_all()
        self._spool.delete_up_to(number)
