"""The service's trail: every change with its row, looks and refusals by way of the disk, and the anchor behind both."""

import asyncio
import contextlib
import json
import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final, Protocol

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from kata.actor import REQUEST_CONTEXT
from kata.audit import chain
from kata.audit.anchor import Anchor, Line
from kata.audit.chain import Entry, Head
from kata.audit.changes import Changes
from kata.audit.deduplication import Repeats
from kata.audit.entries import NOTED, entry, written
from kata.audit.restored import restored
from kata.audit.tables import AuditRow
from kata.database.engine import Database

ROWS: Final = "kata.audit"
"""The logger that is told every row; only where the log is collected (``api/logs.py``)."""

log = logging.getLogger(__name__)
_rows = logging.getLogger(ROWS)

_ROOM_AGAIN_S: Final = 0.2
_LAST_S: Final = 10.0
"""So long the end of the service waits for a database that is slow."""
_LOOK_S: Final = 60.0
"""So often the head is anchored that other services on the same database have come to."""
_ANCHOR_AGAIN_S: Final = 5.0
_CHANGES: Final = "changes"
_HEAD: Final = "head"


class AuditHook:
    """Has each writing session of a database end with its rows of the trail. Enough for a tool; the service has a :class:`AuditLog`."""

    def __init__(self, database: Database) -> None:
        """From now on."""
        database.session_hook = self
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
            context = REQUEST_CONTEXT.get()
            subject = (context.subject if context else "") or changes.subject
            action = context.action if context else "unnamed"
            entries = [entry(action, "done", changes.patient_id, subject, changes.detail())]
        if entries:
            session.info[_HEAD] = chain.append(session, entries, self._anchor_id, self._anchored), entries

    def committed(self, session: Session) -> None:
        """Say at the edge that it stands in the trail."""
        noted: tuple[Head, list[Entry]] | None = session.info.pop(_HEAD, None)
        if noted:
            head, entries = noted
            if context := REQUEST_CONTEXT.get():
                context.told |= {one.outcome for one in entries}
            self._stands(head)
            elsewhere(head, entries)

    def _stands(self, head: Head) -> None:
        """The chain has come to ``head``."""


class Keeps(Protocol):
    """Has entries written down, in the order in which it was given them, however long the database is away."""

    @property
    def has_room(self) -> bool:
        """Whether it can take what may wait outside."""

    def put_entry(self, entry: Entry) -> None:
        """Returns at once."""

    def until_taken(self, limit_s: float) -> bool:
        """Whether the database has all of them within so many seconds."""


class AuditLog(AuditHook):
    """As :class:`AuditHook`; for what no change carries, too, and with a thread for the anchor.

    That goes by way of the disk (``keeps``), so that nobody waits for the database, and gets its place in the chain when it arrives.
    """

    def __init__(
        self, database: Database, anchor: Path, keeps: Keeps, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Compares the anchor with the chain, notes what is found, and starts the thread.

        :raises AnchorError: when the anchor cannot be written.
        """
        super().__init__(database)
        self._database, self._keeps = database, keeps
        self._anchor = Anchor(anchor)
        self._anchor_id, self._anchored = self._anchor.id, self._anchor.lines
        self._clock = clock
        self._repeats = Repeats()
        self._something = threading.Condition()
        self._head: Head | None = None
        self._closing = False
        self._look_s = clock() + _LOOK_S
        self._begin()
        self._thread = threading.Thread(target=self._run, name="audit trail", daemon=True)
        self._thread.start()

    async def tell(self, one: Entry) -> None:
        """Have a look or a refusal written down, once a minute; waits, with its answer, while not even the disk takes any."""
        while not self._keeps.has_room:  # noqa: ASYNC110 - a disk tells nobody that it has room again
            await asyncio.sleep(_ROOM_AGAIN_S)
        with self._something:
            for entry in self._repeats.take(one, self._clock()):
                self._keeps.put_entry(entry)
            self._something.notify_all()

    def tell_at_once(self, one: Entry) -> None:
        """Have what the apparatus was told to do, or what the program did by itself, written down. Never waits."""
        self._keeps.put_entry(one)

    def until_written(self, limit_s: float = 10.0) -> bool:
        """Whether all that was told so far stands in the database, and in the anchor, within so many seconds."""
        until = time.monotonic() + limit_s
        if not self._keeps.until_taken(limit_s):
            return False
        with self._something:
            return self._something.wait_for(lambda: self._head is None, max(0.0, until - time.monotonic()))

    def close(self) -> None:
        """Have the last rows written down, wait for them as long as the database takes any, and end the thread."""
        with self._something:
            for counted in self._repeats.over(float("inf")):
                self._keeps.put_entry(counted)
        self._keeps.put_entry(entry("service_ended", "done"))
        if self._database.unavailable_since or not self.until_written(_LAST_S):
            log.warning("the database does not take the last rows of the audit trail; the next start brings them there")
        with self._something:
            self._closing = True
            self._something.notify_all()
        self._thread.join()
        if self._anchor.last:
            log.info("the audit trail ends at %s", named(self._anchor.last.head))
        self._anchor.close()

    def _stands(self, head: Head) -> None:
        with self._something:
            if self._head is None or head.number > self._head.number:
                self._head = head
            self._something.notify_all()

    def _begin(self) -> None:
        """A crash between commit and anchor leaves rows that no line speaks of, and is no harm; the opposite is."""
        last = self._anchor.last
        with self._database.read() as session:
            present = chain.head(session)
            broken = last and not _goes_on(session, last)
        if last and broken:
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
            self._keeps.put_entry(entry("audit_broken", "failed", detail=detail))
        not_anchored = {"not_anchored": present.number - last.head.number} if last else None
        self._keeps.put_entry(entry("service_started", "done", detail=not_anchored))
        log.info("the audit trail begins at %s", named(present))

    def _run(self) -> None:
        while True:
            with self._something:
                wake_s = min(self._look_s, self._repeats.next_s or self._look_s)
                self._something.wait_for(lambda: self._head or self._closing, max(0.0, wake_s - self._clock()))
                closing = self._closing
                for counted in self._repeats.over(self._clock()):
                    self._keeps.put_entry(counted)
            self._anchor_head()
            if closing:
                return

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
                self._something.notify_all()


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
