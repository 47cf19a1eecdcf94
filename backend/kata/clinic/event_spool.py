"""Spool device events, audit entries and offline session events on the station's disk until the database has them.

Ids are generated where an event occurs, so an event that is delivered twice is stored once. Writers do not wait for delivery.
"""

import logging
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from typing import Final, Literal
from uuid import UUID

import msgspec
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from kata.actor import by_program
from kata.audit import chain
from kata.audit.chain import Entry
from kata.audit.entries import ADDED, add_entry, entry
from kata.clinic.events.observer import AlarmsEnded, NewDeviceEvent
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.recordings.tables import TeachingRow
from kata.clinic.sessions import replay, runs, service
from kata.clinic.sessions.replay import (
    CheckAnswered,
    OfflineEvent,
    PainRecorded,
    RunStarted,
    SessionClosed,
    SessionOpened,
)
from kata.database.delivery import RETRY_S, Delivery
from kata.database.engine import Database
from kata.database.spool import Record, Spool

log = logging.getLogger(__name__)

_CLOSE_LIMIT_S: Final = 10.0
"""Longest wait in seconds for a slow database while the service shuts down. Undelivered events stay on disk."""
_DISK_WRITE_LIMIT_S: Final = 2.0
"""Longest wait in seconds of an offline action for the disk. The action is refused if its event is not on disk by then."""
_MAX_UNWRITTEN_EVENTS: Final = 5000
"""From this number of events that wait for the disk on, read requests and refusals wait to be recorded. Commands to the apparatus never
wait.
"""


class _DeviceEvent(msgspec.Struct, frozen=True, tag="happened"):
    happening: NewDeviceEvent


class _Acknowledged(msgspec.Struct, frozen=True, tag="over"):
    ended: AlarmsEnded


class _AuditEntry(msgspec.Struct, frozen=True, tag="noted"):
    entry: Entry


class NotBegun(msgspec.Struct, frozen=True, tag="not_begun"):
    """Remove a run or teaching that never reached the device, or a session that was never reported to its user."""

    what: Literal["run", "teaching", "session"]
    id: UUID


_SingleItem = NotBegun | OfflineEvent
"""An item that is stored in a transaction of its own, with its audit entry."""
_SpoolItem = _DeviceEvent | _Acknowledged | _AuditEntry | _SingleItem
_DECODER: Final = msgspec.json.Decoder(_SpoolItem)


class EventSpool:
    """Spools events and delivers them to the database. Every ``put`` except :meth:`put_offline_event` returns at once."""

    def __init__(self, database: Database, station: str, folder: Path, *, retry_s: float = RETRY_S) -> None:
        """``folder``: folder of the spool. ``retry_s``: pause before the next attempt to deliver, seconds.

        :raises SpoolError: if the folder holds a record that cannot be read.
        :raises OSError: if the folder cannot be written to.
        """
        self._station = station
        self.spool = Spool(folder)
        self.delivery = Delivery(self.spool, database, station, self._store_batch, retry_s=retry_s)

    @property
    def has_room(self) -> bool:
        """False while too many events wait for the disk. Read requests and refusals must then wait to be recorded."""
        return self.spool.unwritten < _MAX_UNWRITTEN_EVENTS

    def put_event(self, item: NewDeviceEvent | AlarmsEnded) -> None:
        """Spool a device event."""
        self._put(_DeviceEvent(item) if isinstance(item, NewDeviceEvent) else _Acknowledged(item))

    def put_entry(self, entry: Entry) -> None:
        """Spool an audit entry. The entry gets its place in the chain when it is delivered."""
        self._put(_AuditEntry(entry))

    def put_not_begun(self, kind: Literal["run", "teaching", "session"], id_: UUID) -> None:
        """Spool the removal of a run, teaching or session that never began."""
        self._put(NotBegun(kind, id_))

    def put_offline_event(self, event: OfflineEvent, limit_s: float = _DISK_WRITE_LIMIT_S) -> bool:
        """Spool an offline event. Return True if it is on disk within ``limit_s`` seconds."""
        self._put(event)
        return self.spool.until_written(limit_s)

    def until_taken(self, limit_s: float) -> bool:
        """Wait at most ``limit_s`` seconds. Return True if the database then has every event put so far."""
        return self.delivery.until_taken(limit_s)

    def close(self) -> None:
        """Deliver the events that the database accepts within ``_CLOSE_LIMIT_S`` seconds, and end."""
        self.spool.until_written(_CLOSE_LIMIT_S)
        self.delivery.close(_CLOSE_LIMIT_S)
        self.spool.close()

    def _put(self, item: _SpoolItem) -> None:
        self.spool.put(msgspec.json.encode(item))

    def _store_batch(self, session: Session, records: Sequence[Record]) -> int:
        items = [_decoded(record) for record in records]
        if isinstance(first := items[0], _SingleItem):
            self._store_single(session, first)
            return 1
        batch = list(takewhile(lambda item: not isinstance(item, _SingleItem), items))
        _store_events(session, batch)
        entries = [item.entry for item in batch if isinstance(item, _AuditEntry)]
        if entries:
            session.info.setdefault(ADDED, []).extend(entries)
        return len(batch)

    def _store_single(self, session: Session, item: _SingleItem) -> None:
        match item:
            case NotBegun():
                with by_program("never_begun", self._station):
                    add_entry(session, entry("never_begun", subject=f"{item.what} {item.id}"))
                _remove(session, item)
                return
            case SessionOpened():
                with by_program("opened_without_database", self._station):
                    add_entry(
                        session,
                        entry("opened_without_database", patient_id=item.patient_id, subject=f"session {item.id}"),
                    )
            case RunStarted():
                with by_program("begun_without_database", self._station):
                    add_entry(session, entry("begun_without_database", subject=f"run {item.id}"))
            case CheckAnswered():
                with by_program("ticked_without_database", self._station):
                    detail = {"identity": item.subject} if item.check == "identity" else None
                    add_entry(
                        session,
                        entry("ticked_without_database", subject=f"session {item.session_id}", detail=detail),
                    )
            case PainRecorded():
                with by_program("pain_without_database", self._station):
                    add_entry(session, entry("pain_without_database", subject=f"session {item.session_id}"))
            case SessionClosed():
                with by_program("ended_without_database", self._station):
                    add_entry(session, entry("ended_without_database", subject=f"session {item.session_id}"))
        replay.store(session, item)


def _decoded(record: Record) -> _SpoolItem:
    try:
        decoded: _SpoolItem = _DECODER.decode(record.payload)
    except msgspec.MsgspecError as error:
        raise ValueError(f"record {record.number} of the spool was written by another version: {error}") from error
    return decoded


def _store_events(session: Session, items: Sequence[_SpoolItem]) -> None:
    new = [item.happening for item in items if isinstance(item, _DeviceEvent)]
    stored = set(session.scalars(select(DeviceEventRow.id).where(DeviceEventRow.id.in_([event.id for event in new]))))
    rows = {event.id: DeviceEventRow(**vars(event), ended_at=None) for event in new if event.id not in stored}
    session.add_all(rows.values())
    session.flush()
    for item in items:
        if isinstance(item, _Acknowledged):
            end_alarms = update(DeviceEventRow).where(DeviceEventRow.id.in_(item.ended.ids))
            session.execute(end_alarms.values(ended_at=item.ended.at))


def _remove(session: Session, item: NotBegun) -> None:
    # A server that hung may still execute a commit on which the service has given up.
    chain.wait_for_others(session)
    if item.what == "run":
        runs.remove_refused(session, item.id)
    elif item.what == "session":
        service.remove_unannounced(session, item.id)
    elif row := session.get(TeachingRow, item.id):
        session.delete(row)
