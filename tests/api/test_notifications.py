"""Notifications by role: alarms for all users; erasures, break-glass accesses and failed backups for administrators."""

from datetime import timedelta
from uuid import UUID, uuid4

from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.api.notifications import Notification, NotificationsRead, list_notifications, mark_notifications_read
from kata.auth.tables import ReadNotificationRow
from kata.backups.tables import BackupRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import ErasureRow
from kata.clinic.restricted.tables import BreakGlassAccessRow
from kata.clinic.sessions.tables import SessionRow
from kata.clinic.tables import EpisodeRow, PatientRow
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.login import signed_in_actor
from tests.support.treatment import Texts, treat

NOW = utc_now()


def add_backup(
    session: Session, hours_ago: int, problem: str = "", *, test_problem: str = "", tested: bool = True
) -> None:
    at = NOW - timedelta(hours=hours_ago)
    session.add(
        BackupRow(
            id=uuid4(), at=at, kind="nightly", file="", bytes=1, problem=problem, tested_at=at if tested else None,
            test_problem=test_problem, audit_problem="",
        )
    )  # fmt: skip


def add_alarm(session: Session, code: str, days_ago: int = 0, *, patient_id: UUID | None = None) -> None:
    session_id = session.query(SessionRow.id).filter_by(patient_id=patient_id).limit(1).scalar() if patient_id else None
    session.add(
        DeviceEventRow(
            id=uuid4(), station="Station 1", at=NOW - timedelta(days=days_ago), kind="alarm", code=code,
            message="M.", patient_id=patient_id, session_id=session_id,
        )
    )  # fmt: skip


def notifications(database: Database, who: Actor) -> list[Notification]:
    return list_notifications(database, who).items


def kinds(found: list[Notification]) -> list[tuple[str, str]]:
    return [(notice.kind, notice.problem or notice.code or notice.name) for notice in found]


def test_every_role_gets_what_concerns_it(database: Database) -> None:
    therapist = signed_in_actor(database, "therapist")
    with database.write() as session:
        patient_id = session.get_one(EpisodeRow, treat(session, Texts(), sessions=1, runs=1).episode_id).patient_id
        for hours_ago, problem in ((5, "Before."), (4, ""), (3, "Disk full."), (2, "Disk full again.")):
            add_backup(session, hours_ago, problem)
        add_alarm(session, "estop_pressed", patient_id=patient_id)
        add_alarm(session, "bus_lost", days_ago=8)
        session.add(
            ErasureRow(id=uuid4(), patient_id=patient_id, asked_at=NOW - timedelta(hours=1), reason="", noted_by="N")
        )
        for reviewed_at in (None, NOW):
            session.add(
                BreakGlassAccessRow(
                    id=uuid4(), patient_id=patient_id, account_id=therapist.account_id, reason="Pain.",
                    at=NOW - timedelta(hours=6), until=NOW, reviewed_at=reviewed_at, reviewed_by="",
                )
            )  # fmt: skip
    found = notifications(database, signed_in_actor(database, "administrator"))
    assert kinds(found) == [
        ("alarm", "estop_pressed"),
        ("erasure", ""),
        ("failed_backup", "Disk full again."),
        ("failed_backup", "Disk full."),
        ("emergency_access", therapist.name),
    ]
    assert found[0].session_id is not None
    assert found[1].patient_id == patient_id
    for role in ("viewer", "therapist", "technician"):
        only_alarm = notifications(database, signed_in_actor(database, role))
        assert kinds(only_alarm) == [("alarm", "estop_pressed")], role
        assert (only_alarm[0].session_id is not None) == (role != "technician")


def test_backup_that_fails_its_restore_test_is_a_notification(database: Database) -> None:
    with database.write() as session:
        add_backup(session, 4)
        add_backup(session, 3, test_problem="A table is missing.")
        add_backup(session, 2, test_problem="The key is elsewhere.", tested=False)
    administrator = signed_in_actor(database, "administrator")
    assert kinds(notifications(database, administrator)) == [("unrestorable_backup", "A table is missing.")]


def test_session_of_a_restricted_record_stays_unnamed(database: Database) -> None:
    with database.write() as session:
        patient_id = session.get_one(EpisodeRow, treat(session, Texts(), sessions=1, runs=1).episode_id).patient_id
        session.get_one(PatientRow, patient_id).restricted = True
        add_alarm(session, "estop_pressed", patient_id=patient_id)
        session.add(ErasureRow(id=uuid4(), patient_id=patient_id, asked_at=NOW, reason="", noted_by="N"))
    found = notifications(database, signed_in_actor(database, "administrator"))
    assert kinds(found) == [("alarm", "estop_pressed")]
    assert found[0].session_id is None


def test_read_notifications_stay_read_for_their_account(database: Database) -> None:
    reader, other = signed_in_actor(database, "therapist"), signed_in_actor(database, "therapist")
    with database.write() as session:
        add_alarm(session, "estop_pressed")
    seen = notifications(database, reader)
    answer = mark_notifications_read(database, reader, NotificationsRead(notification_ids=[seen[0].id, uuid4()])).items
    assert [notice.read for notice in answer] == [True]
    with database.write() as session:
        # An alarm of a station that was offline arrives later than newer ones.
        add_alarm(session, "bus_lost", days_ago=1)
    read = {notice.code: notice.read for notice in notifications(database, reader)}
    assert read == {"estop_pressed": True, "bus_lost": False}
    assert not any(notice.read for notice in notifications(database, other))


def test_forgotten_notifications_leave_no_read_mark(database: Database) -> None:
    actor = signed_in_actor(database, "therapist")
    with database.write() as session:
        add_alarm(session, "estop_pressed")
    for _ in range(2):
        mark_notifications_read(
            database, actor, NotificationsRead(notification_ids=[notifications(database, actor)[0].id])
        )
    with database.write() as session:
        session.query(DeviceEventRow).delete()
    mark_notifications_read(database, actor, NotificationsRead(notification_ids=[]))
    with database.read() as session:
        assert session.query(ReadNotificationRow).count() == 0
