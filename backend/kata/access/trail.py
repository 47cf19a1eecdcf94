"""The service's trail: every change with its row, looks and refusals through a queue, and the anchor behind both."""

import asyncio
import contextlib
import json
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Final

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from kata.access import chain
from kata.access.actor import DOING
from kata.access.anchor import Anchor, Line
from kata.access.audit import NOTED, entry, note, written
from kata.access.chain import Entry, Head
from kata.access.changes import Changes
from kata.access.repeats import Repeats
from kata.access.restored import restored
from kata.access.tables import AuditRow
from kata.database.engine import Database

ROWS: Final = "kata.audit"
"""The logger that is told every row; only where the log is collected (``web/logs.py``)."""

log = logging.getLogger(__name__)
_rows = logging.getLogger(ROWS)

_ROOM: Final = 2000
_AT_ONCE: Final = 500
_AGAIN_S: Final = 1.0
_LAST_S: Final = 10.0
"""So long the end of the service waits for a database that cannot be written to."""
_LOOK_S: Final = 60.0
"""So often the head is anchored that other services on the same database have come to."""
_ANCHOR_AGAIN_S: Final = 5.0
_CHANGES: Final = "changes"
_HEAD: Final = "head"


class Chained:
    """Has each writing session of a database end with its rows of the trail. Enough for a tool; the service has a :class:`Trail`."""

    def __init__(self, database: Database) -> None:
        """From now on."""
        database.witness = self
        self._anchor_id, self._anchored = "", 0

    def began(self, session: Session) -> None:
        """Look at what it changes."""
        session.info[_CHANGES] = Changes(session)

    def about_to_commit(self, session: Session) -> None:
        """Write down what was noted; where nothing was, what has changed, as the request's act."""
        entries: list[Entry] = session.info.pop(NOTED, [])
        changes: Changes = session.info.pop(_CHANGES)
        if changes and entries:
            entries[-1] = _with(entries[-1], changes)
        elif changes:
            doing = DOING.get()
            subject = (doing.subject if doing else "") or changes.subject
            action = doing.action if doing else "unnamed"
            entries = [entry(action, "done", changes.patient_id, subject, changes.detail())]
        if entries:
            session.info[_HEAD] = chain.append(session, entries, self._anchor_id, self._anchored), entries

    def committed(self, session: Session) -> None:
        """Say at the edge that it stands in the trail."""
        noted: tuple[Head, list[Entry]] | None = session.info.pop(_HEAD, None)
        if noted:
            head, entries = noted
            if doing := DOING.get():
                doing.told |= {one.outcome for one in entries}
            self._stands(head)
            elsewhere(head, entries)

    def _stands(self, head: Head) -> None:
        """The chain has come to ``head``."""


class Trail(Chained):
    """As :class:`Chained`; with a thread for what no change carries, and for the anchor.

    Looks and refusals wait in a queue with little room. What finds none waits outside, with its answer; nothing is dropped.
    """

    def __init__(
        self,
        database: Database,
        anchor: Path,
        *,
        room: int = _ROOM,
        again_s: float = _AGAIN_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Compares the anchor with the chain, notes what is found, and starts the thread.

        ``room``: how many may wait; ``again_s``: the pause before the database is tried again.

        :raises AnchorError: when the anchor cannot be written.
        """
        super().__init__(database)
        self._database = database
        self._anchor = Anchor(anchor)
        self._anchor_id, self._anchored = self._anchor.id, self._anchor.lines
        self._room, self._again_s, self._clock = room, again_s, clock
        self._repeats = Repeats()
        self._something = threading.Condition()
        self._waiting: deque[tuple[Entry, bool]] = deque()
        self._outside: deque[Callable[[], object]] = deque()
        self._head: Head | None = None
        self._closing = False
        self._gives_up_s: float | None = None
        self._look_s = clock() + _LOOK_S
        self._begin()
        self._thread = threading.Thread(target=self._run, name="audit trail", daemon=True)
        self._thread.start()

    async def tell(self, one: Entry) -> None:
        """Have a look or a refusal written down, once a minute; waits while there is no room."""
        loop = asyncio.get_running_loop()
        while True:
            with self._something:
                if len(self._waiting) < self._room:
                    self._put(one, repeats=True)
                    return
                room = asyncio.Event()
                self._outside.append(partial(loop.call_soon_threadsafe, room.set))
            await room.wait()

    def tell_at_once(self, one: Entry) -> None:
        """Have what the apparatus was told to do, or what the program did by itself, written down. Never waits."""
        with self._something:
            self._put(one, repeats=False)

    @property
    def waiting(self) -> int:
        """Rows that are not in the database yet."""
        return len(self._waiting)

    def until_written(self, limit_s: float = 10.0) -> bool:
        """Whether all that was told so far stands in the database, and in the anchor, within so many seconds."""
        with self._something:
            return self._something.wait_for(lambda: not self._waiting and self._head is None, limit_s)

    def close(self) -> None:
        """Write down what waits, as far as the database takes it in time, and end the thread."""
        with self._something:
            self._put(entry("service_ended", "done"), repeats=False)
            self._closing, self._gives_up_s = True, self._clock() + _LAST_S
        self._thread.join(_LAST_S + self._again_s)
        if self._anchor.last:
            log.info("the audit trail ends at %s", named(self._anchor.last.head))
        self._anchor.close()

    def _put(self, one: Entry, *, repeats: bool) -> None:
        if self._closing:
            log.critical("the audit trail has been closed; this is not in it: %s", one)
        self._waiting.append((one, repeats))
        self._something.notify_all()

    def _stands(self, head: Head) -> None:
        with self._something:
            if self._head is None or head.number > self._head.number:
                self._head = head
            self._something.notify_all()

    def _begin(self) -> None:
        """A crash between commit and anchor leaves rows that no line speaks of, and is no harm; the opposite is."""
        last = self._anchor.last
        with self._database.write() as session:
            present = chain.head(session)
            if last and not _goes_on(session, last):
                log.critical(
                    "the audit trail does not go on where it was anchored, at %s: it ends at %s; run kata audit verify",
                    named(last.head),
                    named(present),
                )
                detail = {
                    "anchor": last.anchor,
                    "line": last.line,
                    "anchored": last.head.number,
                    "head": present.number,
                }
                note(session, "audit_broken", "failed", detail=detail)
            note(
                session, "service_started", detail={"not_anchored": present.number - last.head.number} if last else None
            )
        log.info("the audit trail begins at %s", named(present))

    def _run(self) -> None:
        while True:
            with self._something:
                wake_s = min(self._look_s, self._repeats.next_s or self._look_s)
                self._something.wait_for(
                    lambda: self._waiting or self._head or self._closing, max(0.0, wake_s - self._clock())
                )
                batch = [self._waiting[n] for n in range(min(_AT_ONCE, len(self._waiting)))]
                last = self._closing and len(batch) == len(self._waiting)
            self._write(batch, last=last)
            self._anchor_head()
            with self._something:
                for _ in batch:
                    self._waiting.popleft()
                while self._outside:
                    self._outside.popleft()()
                self._something.notify_all()
                if last and not self._waiting:
                    return

    def _write(self, batch: list[tuple[Entry, bool]], *, last: bool) -> None:
        """Until the database has it."""
        now_s = self._clock()
        entries: list[Entry] = []
        for one, repeats in batch:
            entries += self._repeats.take(one, now_s) if repeats else [one]
        entries += self._repeats.over(float("inf") if last else now_s)
        while entries:
            try:
                with self._database.write() as session:
                    session.info[NOTED] = list(entries)
                return
            except SQLAlchemyError as error:
                log.warning("%d rows of the audit trail wait for the database: %s", len(entries), error)
            if self._gives_up_s is not None and self._clock() > self._gives_up_s:
                log.critical("the database takes no rows of the audit trail; these are lost: %s", entries)
                return
            time.sleep(self._again_s)

    def _anchor_head(self) -> None:
        if self._clock() >= self._look_s:
            self._look_s = self._clock() + _LOOK_S
            with contextlib.suppress(SQLAlchemyError), self._database.read() as session:
                self._stands(chain.head(session))
        with self._something:
            head = self._head
        if head is None:
            return
        try:
            if self._anchor.last is None or self._anchor.last.head != head:
                self._anchor.add(head)
        except OSError as error:
            log.critical("the audit trail's anchor cannot be written: %s", error)
            self._look_s = self._clock() + _ANCHOR_AGAIN_S
        self._anchored = self._anchor.lines
        with self._something:
            if self._head == head:
                self._head = None


def _goes_on(session: Session, last: Line) -> bool:
    if last.head == chain.NOTHING:
        return True
    stands = session.scalar(select(AuditRow.hash).where(AuditRow.number == last.head.number))
    return stands == last.head.hash or any(gap.holds(last) for gap in restored(session))


def elsewhere(head: Head, entries: Sequence[Entry]) -> None:
    """Tell the log what now stands in the trail up to ``head``: a program that collects it keeps it where this service cannot reach."""
    if _rows.isEnabledFor(logging.INFO):
        for number, one in enumerate(entries, head.number - len(entries) + 1):
            row = {name: value for name, value in asdict(one).items() if value not in ("", None)} | {"number": number}
            if number == head.number:
                row["hash"] = head.hash.hex()
            _rows.info("%s %s", one.action, one.outcome, extra={"audit": row})


def named(head: Head) -> str:
    """As it is told to people, who keep it where the program does not reach: ``kata audit verify --head`` takes it."""
    return f"{head.number}:{head.hash.hex()}"


def _with(one: Entry, changes: Changes) -> Entry:
    detail = json.loads(one.detail or "{}") | changes.detail()
    return replace(
        one,
        patient_id=one.patient_id or changes.patient_id,
        subject=one.subject or changes.subject,
        detail=written(detail),
    )
