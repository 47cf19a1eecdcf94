"""The audit trail of a service.

:class:`AuditHook` adds the rows of a change to the transaction that makes the change (see :meth:`kata.database.engine.Database.write`).
    Views and refusals change no row, so :class:`AuditLog` queues them on disk and delivers them to the database. A thread anchors the
    chain's head in a file.
"""

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
from kata.audit.anchor import Anchor, AnchorLine
from kata.audit.anchor_copy import AnchorCopy, is_elsewhere
from kata.audit.chain import Entry, Head
from kata.audit.changes import Changes
from kata.audit.deduplication import Deduplicator, RecordedViews
from kata.audit.entries import ADDED, as_json, entry
from kata.audit.restored import restored_gaps
from kata.audit.tables import AuditRow
from kata.database.engine import Database

AUDIT_ROW_LOGGER: Final = "kata.audit"
"""Name of the logger that writes every row. It is used only if the log is collected (``api/logs.py``)."""

log = logging.getLogger(__name__)
_row_log = logging.getLogger(AUDIT_ROW_LOGGER)

_FULL_POLL_S: Final = 0.2
_SHUTDOWN_LIMIT_S: Final = 10.0
"""Seconds that the service's shutdown waits for the database."""
_FOREIGN_HEAD_PERIOD_S: Final = 60.0
"""Seconds between two checks for heads that other services on the same database have written, which are then anchored."""
_HEAD_LOG_PERIOD_S: Final = 3600.0
"""Seconds between two heads in the log, from where a log collector takes them to another computer."""
_ANCHOR_RETRY_S: Final = 5.0
_RECENT_ROWS: Final = 1000
_CHANGES: Final = "changes"
_HEAD: Final = "head"


class AuditHook:
    """Adds the audit rows of every writing session to its transaction. Commands use it directly; the service uses :class:`AuditLog`."""

    def __init__(self, database: Database) -> None:
        """Register as the database's session hook."""
        database.session_hook = self
        self._anchor_id, self._anchor_lines = "", 0

    def began(self, session: Session) -> None:
        """Start to collect the session's changes."""
        session.info[_CHANGES] = Changes(session)

    def about_to_commit(self, session: Session) -> None:
        """Append the session's added entries. If there are none, append one entry of its changes, under the request's action."""
        entries: list[Entry] = session.info.pop(ADDED, [])
        changes: Changes = session.info.pop(_CHANGES)
        if changes and entries:
            entries[-1] = _with_changes(entries[-1], changes)
        elif changes:
            context = REQUEST_CONTEXT.get()
            subject = (context.subject if context else "") or changes.subject
            action = context.action if context else "unnamed"
            detail = changes.detail() | (context.detail if context else {})
            entries = [entry(action, "done", changes.patient_id, subject, detail)]
        if entries:
            session.info[_HEAD] = chain.append(session, entries, self._anchor_id, self._anchor_lines), entries

    def committed(self, session: Session) -> None:
        """Mark the request as audited, and report the new head."""
        appended: tuple[Head, list[Entry]] | None = session.info.pop(_HEAD, None)
        if appended:
            head, entries = appended
            if context := REQUEST_CONTEXT.get():
                context.audited |= {item.outcome for item in entries}
            self._note_head(head)
            log_rows(head, entries)

    def _note_head(self, head: Head) -> None:
        """Receive the new head of the chain."""


class EntrySpool(Protocol):
    """Queues entries on disk and delivers them to the database in order. It keeps them during an outage."""

    @property
    def has_room(self) -> bool:
        """Return whether entries that may wait can be queued."""

    def put_entry(self, entry: Entry) -> None:
        """Queue an entry. Return at once."""

    def until_taken(self, limit_s: float) -> bool:
        """Wait at most ``limit_s`` seconds. Return whether the database then has all entries."""


class AuditLog(AuditHook):
    """An :class:`AuditHook` that also records entries without a change, and anchors the chain in a file.

    Entries without a change go through a spool on disk, so that no request waits for the database. They get their place in the chain when
    they reach the database.
    """

    def __init__(
        self,
        database: Database,
        anchor: Path,
        spool: EntrySpool,
        *,
        copy: Path | None = None,
        data: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Compare the anchor and its copy with the chain, record the result, and start the threads.

        :param copy: a second file for the lines of the anchor.
        :param data: the data folder; default: the anchor's folder.
        :raises AnchorError: when the anchor cannot be written.
        """
        super().__init__(database)
        self._database, self._spool = database, spool
        self._anchor = Anchor(anchor)
        self._anchor_id, self._anchor_lines = self._anchor.id, self._anchor.lines
        self._clock = clock
        self._deduplicator = Deduplicator()
        self.recorded_views = RecordedViews()
        """Only the event loop's thread uses it."""
        self._changed = threading.Condition()
        self._head: Head | None = None
        self._closing = False
        self._next_look_s = clock() + _FOREIGN_HEAD_PERIOD_S
        self._next_log_s = clock() + _HEAD_LOG_PERIOD_S
        self._record_start()
        data = data or anchor.parent
        self._anchor_elsewhere = [anchor] if is_elsewhere(anchor, data) else []
        self.copy = AnchorCopy(copy, anchor, data, self._report_shortened_anchor) if copy else None
        """The anchor's copy, if one is configured."""
        self._thread = threading.Thread(target=self._run, name="audit trail", daemon=True)
        self._thread.start()

    async def record(self, entry: Entry) -> None:
        """Record a view or a refusal; equal entries at most once a minute. While the disk is full, this waits and so delays the answer."""
        while not self._spool.has_room:  # noqa: ASYNC110 - a disk does not signal free space
            await asyncio.sleep(_FULL_POLL_S)
        with self._changed:
            for due_entry in self._deduplicator.add(entry, self._clock()):
                self._spool.put_entry(due_entry)
            self._changed.notify_all()

    def record_at_once(self, entry: Entry) -> None:
        """Record a command to the apparatus or an action of the program. Never wait."""
        self._spool.put_entry(entry)

    def until_written(self, limit_s: float = 10.0) -> bool:
        """Wait at most ``limit_s`` seconds. Return whether all entries so far are then in the database and anchored."""
        until = time.monotonic() + limit_s
        if not self._spool.until_taken(limit_s):
            return False
        with self._changed:
            return self._changed.wait_for(lambda: self._head is None, max(0.0, until - time.monotonic()))

    def close(self) -> None:
        """Record the last entries, wait for them if the database answers, and end the thread."""
        with self._changed:
            for counted in self._deduplicator.expire(float("inf")):
                self._spool.put_entry(counted)
        self._spool.put_entry(entry("service_ended", "done"))
        if self._database.unavailable_since or not self.until_written(_SHUTDOWN_LIMIT_S):
            log.warning("the last audit entries have not reached the database; the next start delivers them")
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        if self._anchor.last:
            log.info("the audit trail ends at %s", format_head(self._anchor.last.head))
        self._anchor.close()
        if self.copy:
            self.copy.close()

    def _note_head(self, head: Head) -> None:
        with self._changed:
            if self._head is None or head.number > self._head.number:
                self._head = head
            self._changed.notify_all()

    def _record_start(self) -> None:
        """Compare anchor and chain. Rows after the last anchored one are harmless, because the service may have crashed before anchoring
        them. A missing anchored row is an error.
        """
        last = self._anchor.last
        with self._database.read() as session:
            present = chain.head(session)
            broken = last and not _contains_anchored_head(session, last)
        if last and broken:
            self._report_missing(last, present)
        not_anchored = {"not_anchored": present.number - last.head.number} if last else None
        self._spool.put_entry(entry("service_started", "done", detail=not_anchored))
        log.info("the audit trail begins at %s", format_head(present))

    def _report_missing(self, last: AnchorLine, present: Head) -> None:
        log.critical(
            "the anchor has the head %s, but the audit trail ends at %s: entries are missing; run kata audit verify",
            format_head(last.head),
            format_head(present),
        )
        detail = {"anchor": last.anchor, "line": last.line, "anchored": last.head.number, "head": present.number}
        self._spool.put_entry(entry("audit_broken", "failed", detail=detail))

    def _report_shortened_anchor(self, last: AnchorLine) -> None:
        """Report that the anchor lacks lines of its copy. Called from the copy's thread."""
        with contextlib.suppress(SQLAlchemyError), self._database.read() as session:
            if not any(gap.explains(last) for gap in restored_gaps(session)):
                self._report_missing(last, chain.head(session))

    @property
    def elsewhere(self) -> list[Path]:
        """Return the files on another disk or computer that contain heads of the chain."""
        return self._anchor_elsewhere + ([self.copy.file] if self.copy and self.copy.is_elsewhere else [])

    def has_other_anchors(self, session: Session) -> bool:
        """Return whether other services on this database also anchor the trail: recent rows then name another anchor."""
        newest = chain.head(session).number
        other = AuditRow.anchor.not_in(("", self._anchor_id))
        query = select(AuditRow.number).where(AuditRow.number > newest - _RECENT_ROWS, other).limit(1)
        return session.scalar(query) is not None

    def _run(self) -> None:
        while True:
            with self._changed:
                wake_s = min(self._next_look_s, self._deduplicator.next_s or self._next_look_s)
                self._changed.wait_for(lambda: self._head or self._closing, max(0.0, wake_s - self._clock()))
                closing = self._closing
                for counted in self._deduplicator.expire(self._clock()):
                    self._spool.put_entry(counted)
            self._anchor_head()
            if closing:
                return

    def _anchor_head(self) -> None:
        if self._clock() >= self._next_look_s:
            self._next_look_s = self._clock() + _FOREIGN_HEAD_PERIOD_S
            with contextlib.suppress(SQLAlchemyError), self._database.read() as session:
                self._note_head(chain.head(session))
        with self._changed:
            head = self._head
        if head is None:
            return
        try:
            if self._anchor.last is None or self._anchor.last.head != head:
                self._anchor.add(head)
                if self.copy and self._anchor.last:
                    self.copy.add(self._anchor.last)
                if self._clock() >= self._next_log_s:
                    self._next_log_s = self._clock() + _HEAD_LOG_PERIOD_S
                    log.info("the audit trail has reached %s", format_head(head))
        except OSError as error:
            log.critical("the audit trail's anchor cannot be written: %s", error)
            self._next_look_s = self._clock() + _ANCHOR_RETRY_S
        self._anchor_lines = self._anchor.lines
        with self._changed:
            if self._head == head:
                self._head = None
                self._changed.notify_all()


def _contains_anchored_head(session: Session, last: AnchorLine) -> bool:
    """Return whether the chain contains the anchored head, or a restored backup explains its absence."""
    if last.head == chain.NOTHING:
        return True
    stored = session.scalar(select(AuditRow.hash).where(AuditRow.number == last.head.number))
    return stored == last.head.hash or any(gap.explains(last) for gap in restored_gaps(session))


def log_rows(head: Head, entries: Sequence[Entry]) -> None:
    """Log the rows up to ``head``, so that a log collector stores them where this service cannot change them."""
    if _row_log.isEnabledFor(logging.INFO):
        for number, entry in enumerate(entries, head.number - len(entries) + 1):
            row = {name: value for name, value in asdict(entry).items() if value not in ("", None)} | {"number": number}
            if number == head.number:
                row["hash"] = head.hash.hex()
            _row_log.info("%s %s", entry.action, entry.outcome, extra={"audit": row})


def format_head(head: Head) -> str:
    """Return a head in the form that people store elsewhere and that ``kata audit verify --head`` accepts."""
    return f"{head.number}:{head.hash.hex()}"


def _with_changes(entry: Entry, changes: Changes) -> Entry:
    detail = json.loads(entry.detail or "{}") | changes.detail()
    return replace(
        entry,
        patient_id=entry.patient_id or changes.patient_id,
        subject=entry.subject or changes.subject,
        detail=as_json(detail),
    )
