"""Writes down what happened, in a thread of its own: a slow or locked database keeps nobody waiting but this thread."""

import logging
import queue
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

from sqlalchemy import select, update
from sqlalchemy.exc import OperationalError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as NoConnectionError
from sqlalchemy.orm import Session

from kata.clinic.events.observer import Ended, Happening
from kata.clinic.events.tables import DeviceEventRow
from kata.database.engine import Database

log = logging.getLogger(__name__)

_WAITING: Final = 10_000
_AT_ONCE: Final = 500
_AGAIN_S: Final = 1.0
_LAST_S: Final = 10.0
"""So long the end of the service waits for a database that cannot be written to."""

Item = Happening | Ended


class EventWriter:
    """A bounded queue and the thread that empties it. What finds it full is dropped, and counted in the log."""

    def __init__(self, database: Database, *, room: int = _WAITING, again_s: float = _AGAIN_S) -> None:
        """Starts the thread. ``room``: how many may wait; ``again_s``: the pause before the database is tried again."""
        self._database = database
        self._queue: queue.Queue[Item | None] = queue.Queue(room)
        self._again_s = again_s
        self._dropped = 0
        self._until_s: float | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="device events", daemon=True)
        self._thread.start()

    def put(self, item: Item) -> None:
        """Have it written down. Never waits."""
        try:
            self._queue.put_nowait(item)
        except queue.Full:
            self._dropped += 1
            if self._dropped == 1:
                log.error("device events are not written down any more: the database has not taken any for too long")
            return
        if self._dropped:
            log.error("%d device events were dropped; they are written down again from now on", self._dropped)
            self._dropped = 0

    @property
    def waiting(self) -> int:
        """Events that are not in the database yet, besides those that are just being written."""
        return self._queue.qsize()

    def close(self) -> None:
        """Write down what waits, as far as the database takes it in time, and end the thread."""
        self._until_s = time.monotonic() + _LAST_S
        self._closing.set()
        try:
            self._queue.put(None, timeout=_LAST_S)
        except queue.Full:
            log.error("the database takes no device events; %d of them are lost", self._queue.qsize())
            return
        self._thread.join(_LAST_S + self._again_s)

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            batch, last = self._more(item)
            self._write(batch)
            if last:
                return

    def _more(self, first: Item) -> tuple[list[Item], bool]:
        """What waits besides the first; and whether that is all there will ever be."""
        batch = [first]
        while len(batch) < _AT_ONCE:
            try:
                item = self._queue.get_nowait()
            except queue.Empty:
                break
            if item is None:
                return batch, True
            batch.append(item)
        return batch, False

    def _write(self, batch: Sequence[Item]) -> None:
        """Until the database has it. Nothing is given up but what the database refuses for itself."""
        while True:
            try:
                with self._database.write() as session:
                    _keep(session, batch)
                return
            except (OperationalError, NoConnectionError) as error:
                log.warning("%d device events wait for the database: %s", len(batch), error)
            except SQLAlchemyError:
                if len(batch) == 1:
                    log.exception("a device event cannot be written down: %s", batch[0])
                    return
                for item in batch:
                    self._write([item])
                return
            if self._until_s is not None and time.monotonic() > self._until_s:
                log.error("the database takes no device events; %d of them are lost", len(batch))
                return
            # Once the service ends, the wait is over at once; then it is only tried a little slower than it fails.
            if self._closing.wait(self._again_s):
                time.sleep(min(self._again_s, 0.1))


def _keep(session: Session, batch: Sequence[Item]) -> None:
    new = [item for item in batch if isinstance(item, Happening)]
    there = set(session.scalars(select(DeviceEventRow.id).where(DeviceEventRow.id.in_([one.id for one in new]))))
    session.add_all(DeviceEventRow(**asdict(one), ended_at=None) for one in new if one.id not in there)
    session.flush()
    for item in batch:
        if isinstance(item, Ended):
            session.execute(update(DeviceEventRow).where(DeviceEventRow.id.in_(item.ids)).values(ended_at=item.at))
