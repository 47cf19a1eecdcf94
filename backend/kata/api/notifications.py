"""Notifications for the user of a page: open erasures, break-glass accesses without a review, failed backups, and recent alarms.

Pages ask at intervals. The answer has ids and times but no content of a record, so the audit trail records no view.
"""

from collections.abc import Iterator
from datetime import datetime, timedelta
from typing import Final, Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import Field
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.auth import accounts
from kata.auth.permissions import ROLE_PERMISSIONS
from kata.auth.tables import ReadNotificationRow
from kata.backups import catalogue
from kata.clinic.events import service as events
from kata.clinic.restricted import service as restricted
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.interop import erasures
from kata.pagination import Page
from kata.types import Moment, Schema

router = APIRouter(tags=["notifications"])

_ALARMS_FOR: Final = timedelta(days=7)
"""Age up to which an alarm is a notification. The clinic's figures show older alarms."""
_MOST: Final = 50
"""Maximum number of notifications of one kind."""


class Notification(Schema):
    """Something that the user should know. Another route opens the record behind it."""

    id: UUID
    at: Moment
    kind: Literal["erasure", "emergency_access", "failed_backup", "unrestorable_backup", "alarm"]
    name: str = Field("", description="The user's name, for a break-glass access.", examples=["Sato Ken"])
    problem: str = Field("", description="Why the backup or its restore test failed.")
    station: str = Field("", description="Station of an alarm.", examples=["Station 1"])
    code: str = Field("", description="Cause of an alarm.", examples=["estop_pressed"])
    patient_id: UUID | None = Field(None, description="Patient of a request for erasure.")
    session_id: UUID | None = Field(None, description="Session of an alarm; null if you may not open its record.")
    read: bool = Field(False, description="You have marked it as read.")


class NotificationsRead(Schema):
    """Notifications that the user has read."""

    notification_ids: list[UUID] = Field(
        max_length=4 * _MOST, description="Ids that are no notification of yours are ignored."
    )


@router.get("/api/notifications", summary="List notifications")
def list_notifications(database: TheDatabase, actor: TheActor) -> Page[Notification]:
    """Return your notifications, newest first, at most 50 of each kind. Every user gets the alarms of the last seven days.

    Administrators also get undecided erasures, break-glass accesses without a review, and backups since the last good one that failed or
    did not pass their restore test.
    """
    with database.read() as session:
        return Page[Notification].complete(_find(session, actor))


@router.put("/api/notifications/read", responses=PROBLEMS.of(401, 422), summary="Mark notifications as read")
def mark_notifications_read(database: TheDatabase, actor: TheActor, body: NotificationsRead) -> Page[Notification]:
    """Mark notifications as read on every browser of this account, and return your notifications."""
    with database.write() as session:
        # Its lock lets two browsers of one account mark one after the other.
        accounts.get(session, actor.account_id)
        notifications = _find(session, actor)
        session.execute(delete(ReadNotificationRow).where(ReadNotificationRow.account_id == actor.account_id))
        for notification in notifications:
            notification.read |= notification.id in body.notification_ids
            if notification.read:
                session.add(ReadNotificationRow(account_id=actor.account_id, notification_id=notification.id))
    return Page[Notification].complete(notifications)


def _find(session: Session, actor: Actor) -> list[Notification]:
    """Return the user's notifications, newest first."""
    notifications = list(_alarms(session, actor, utc_now()))
    if "administer" in ROLE_PERMISSIONS[actor.role]:
        notifications += [*_erasures(session, actor), *_break_glass_accesses(session), *_failed_backups(session)]
    read_query = select(ReadNotificationRow.notification_id).where(ReadNotificationRow.account_id == actor.account_id)
    read_ids = set(session.scalars(read_query))
    for notification in notifications:
        notification.read = notification.id in read_ids
    return sorted(notifications, key=lambda notification: (notification.at, notification.id), reverse=True)


def _alarms(session: Session, actor: Actor, now: datetime) -> Iterator[Notification]:
    rows, _ = events.find(session, events.EventFilter(kind="alarm"), _MOST, None)
    for alarm in events.shown_to(session, actor, [row for row in rows if row.at >= now - _ALARMS_FOR]):
        yield Notification(
            id=alarm.id, at=alarm.at, kind="alarm", station=alarm.station, code=alarm.code, session_id=alarm.session_id
        )


def _erasures(session: Session, actor: Actor) -> Iterator[Notification]:
    for row in erasures.undecided(session, restricted.hidden(actor))[-_MOST:]:
        yield Notification(id=row.id, at=row.asked_at, kind="erasure", patient_id=row.patient_id)


def _break_glass_accesses(session: Session) -> Iterator[Notification]:
    for access in restricted.break_glass_accesses(session, _MOST, None)[0]:
        if access.reviewed_at is None:
            yield Notification(id=access.id, at=access.at, kind="emergency_access", name=access.name)


def _failed_backups(session: Session) -> Iterator[Notification]:
    good = catalogue.last_good(session)
    for row in catalogue.newest(session, _MOST)[0]:
        if row.failure and (good is None or row.at > good.at):
            kind: Literal["failed_backup", "unrestorable_backup"] = (
                "failed_backup" if row.problem else "unrestorable_backup"
            )
            yield Notification(id=row.id, at=row.at, kind=kind, problem=row.failure)
