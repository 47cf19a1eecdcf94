"""The audit trail: one chain without gaps, committed with the changes that it records; every tampering is detected."""

import asyncio
import json
import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import pytest
from sqlalchemy import delete, select, text, update
from sqlalchemy.exc import DatabaseError as RefusedError
from sqlalchemy.exc import OperationalError

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, Actor, RequestContext, by_program
from kata.audit import anchor, chain, deduplication, entries
from kata.audit.audit_log import AuditHook, AuditLog
from kata.audit.deduplication import WINDOW_S, Deduplicator, RecordedViews
from kata.audit.restored import note_restored
from kata.audit.tables import AuditRow
from kata.audit.verify import Verdict, verify
from kata.auth.tables import AccountRow, LoginSessionRow
from kata.clinic.event_spool import EventSpool
from kata.clinic.patients.tables import PatientRow
from kata.clinic.stations.tables import StationRow
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.databases import SQLITE_FIRST

SATO = Actor(uuid4(), uuid4(), "Sato", "therapist", frozenset())


def new_patient(number: str = "K-1") -> PatientRow:
    now = utc_now()
    return PatientRow(
        id=uuid4(), clinic_number=number, name="Yamada Hanako", sex="unknown", notes="Sleeps badly.",
        created_at=now, updated_at=now,
    )  # fmt: skip


@contextmanager
def request(action: str, actor: Actor | None = SATO, **fields: Any) -> Iterator[RequestContext]:
    """Set the request context like the audit middleware."""
    context = RequestContext(action, address="192.168.1.7", **fields)
    acting, done = CURRENT_ACTOR.set(actor), REQUEST_CONTEXT.set(context)
    try:
        yield context
    finally:
        CURRENT_ACTOR.reset(acting)
        REQUEST_CONTEXT.reset(done)


@pytest.fixture
def chained(database: Database) -> Database:
    """Return a database with the audit hook of a tool: every change has its row, and there is no anchor."""
    AuditHook(database)
    return database


@contextmanager
def trail_of(database: Database, folder: Path, **given: Any) -> Iterator[AuditLog]:
    spool = EventSpool(database, "Station 1", folder / "spool", **given)
    try:
        made = AuditLog(database, folder / "audit.anchor", spool)
        try:
            # The first row must not share a commit, and thus a line of the anchor, with a test's rows.
            assert made.until_written()
            yield made
        finally:
            made.close()
    finally:
        spool.close()


async def recorded_in_time(audit_log: AuditLog, entry: chain.Entry) -> None:
    async with asyncio.timeout(5.0):
        await audit_log.record(entry)


def rows(database: Database) -> list[AuditRow]:
    with database.read() as session:
        return list(session.scalars(select(AuditRow).order_by(AuditRow.number)))


def verified(database: Database, folder: Path | None = None, known_head: chain.Head | None = None) -> Verdict:
    with database.read() as session:
        return verify(session, [folder / "audit.anchor"] if folder else [], known_head)


class TestWhatIsWritten:
    def test_audit_row_names_who_where_what_whose_but_no_values(self, chained: Database) -> None:
        patient = new_patient()
        with request("create_patient", station="Station 1") as context, chained.write() as session:
            session.add(patient)
        with request("update_patient", patient_id=patient.id), chained.write() as session:
            session.get_one(PatientRow, patient.id).notes = "Sleeps well."
        made, changed = rows(chained)
        assert (made.number, made.who, made.role, made.account_id, made.sign_in_id) == (
            1, "Sato", "therapist", SATO.account_id, SATO.login_session_id,
        )  # fmt: skip
        assert (made.action, made.outcome, made.address, made.station) == (
            "create_patient", "done", "192.168.1.7", "Station 1",
        )  # fmt: skip
        assert made.patient_id == changed.patient_id == patient.id
        assert json.loads(made.detail) == {"added": {"patients": [str(patient.id)]}}
        assert json.loads(changed.detail) == {"changed": {"patients": {str(patient.id): ["notes"]}}}
        assert "Yamada" not in repr([vars(row) for row in rows(chained)])
        assert context.audited == {"done"}
        assert verified(chained).intact

    @SQLITE_FIRST
    def test_rolled_back_change_leaves_no_audit_row_and_no_gap(self, chained: Database) -> None:
        def half_done() -> None:
            with chained.write() as session:
                entries.add_entry(session, entries.entry("half"))
                session.add(new_patient())
                session.flush()
                raise RuntimeError

        with request("create_patient") as context:
            with pytest.raises(RuntimeError):
                half_done()
            assert context.audited == set()
            with chained.write() as session:
                session.add(new_patient())
        assert [(row.number, row.action) for row in rows(chained)] == [(1, "create_patient")]

    def test_change_without_its_audit_row_is_not_made(self, chained: Database, monkeypatch: pytest.MonkeyPatch) -> None:
        def broken(*_: object) -> None:
            raise OperationalError("", None, Exception("disk full"))

        monkeypatch.setattr(chain, "append", broken)
        with request("create_patient"), pytest.raises(OperationalError), chained.write() as session:
            session.add(new_patient())
        with chained.read() as session:
            assert session.query(PatientRow).count() == 0

    def test_audit_note_replaces_the_change_and_names_the_account(self, chained: Database) -> None:
        with request("sign_in", actor=None), chained.write() as session:
            now = utc_now()
            session.add(
                AccountRow(id=uuid4(), username="sato", name="Sato", role="viewer", created_at=now, updated_at=now)
            )
            entries.add_entry(
                session, entries.entry("sign_in", subject="account", detail={"method": "password"}, actor=SATO)
            )
        (row,) = rows(chained)
        assert (row.who, row.account_id, row.subject) == ("Sato", SATO.account_id, "account")
        assert json.loads(row.detail).keys() == {"method", "added"}

    def test_failed_sign_in_records_the_account_that_was_tried(self) -> None:
        whose = uuid4()
        with request("sign_in_by_password", actor=None) as context:
            context.account_id = whose
            tried = entries.entry("sign_in_by_password", "refused")
        assert (tried.who, tried.account_id, tried.sign_in_id) == ("", whose, None)
        with request("sign_in_by_password", actor=SATO) as context:
            context.account_id = whose
            assert entries.entry("sign_in_by_password", "done").account_id == SATO.account_id

    @SQLITE_FIRST
    def test_unrequested_change_is_recorded_as_the_programs(self, chained: Database) -> None:
        with request("turn") as context, by_program("import_journal"), chained.write() as session:
            session.add(new_patient())
        (row,) = rows(chained)
        assert (row.who, row.role, row.account_id, row.address, row.action) == ("Kata", "", None, "", "import_journal")
        assert context.audited == set()

    def test_bookkeeping_has_no_rows_of_its_own(self, chained: Database) -> None:
        now = utc_now()
        account = AccountRow(id=uuid4(), username="a", name="A", role="viewer", created_at=now, updated_at=now)
        with chained.write() as session:
            session.add(account)
        with chained.write() as session:
            session.add(StationRow(name="S", config="", registered_at=now, started_at=now))
            session.get_one(AccountRow, account.id).totp_last_step = 3
        with chained.write() as session:
            fields = {
                "began_at": now,
                "seen_at": now,
                "proved_at": now,
                "method": "password",
                "address": "",
                "agent": "",
            }
            session.add(LoginSessionRow(id=uuid4(), account_id=account.id, secret_hash="0", **fields))
            session.execute(update(LoginSessionRow).values(seen_at=now))
        assert [json.loads(row.detail) for row in rows(chained)] == [{"added": {"accounts": [str(account.id)]}}]

    def test_bulk_changes_are_recorded_by_table_and_row_count(self, chained: Database) -> None:
        with request("erase_patient"), chained.write() as session:
            session.add_all([new_patient(f"K-{n}") for n in range(9)])
            session.flush()
            session.execute(update(PatientRow).values(notes=""))
        assert json.loads(rows(chained)[0].detail) == {"added": {"patients": 9}, "changed_many": ["patients"]}

    @SQLITE_FIRST
    def test_texts_that_no_column_holds_are_cut_and_not_refused(self, chained: Database) -> None:
        with request("odd\0" + "x" * 80, subject="\ud800" + "s" * 200), chained.write() as session:
            entries.add_entry(session, entries.entry("odd\0" + "x" * 80))
        (row,) = rows(chained)
        assert (row.action, row.subject) == ("odd" + "x" * 61, "?" + "s" * 99)
        assert verified(chained).intact


class TestOneChain:
    @SQLITE_FIRST
    def test_concurrent_writers_make_one_chain_without_gaps(self, database: Database) -> None:
        """Write from two engines on one database, four threads each, like two services."""
        other = Database(database.url.render_as_string(hide_password=False))
        ready = threading.Barrier(8)
        failed: list[Exception] = []

        def write(which: Database, name: int) -> None:
            try:
                ready.wait(10)
                for n in range(10):
                    with which.write() as session:
                        session.add(new_patient(f"{name}-{n}"))
            except Exception as error:
                failed.append(error)

        for service in (database, other):
            AuditHook(service)
        threads = [threading.Thread(target=write, args=((database, other)[n % 2], n)) for n in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        other.close()
        assert failed == []
        assert [row.number for row in rows(database)] == list(range(1, 81))
        assert verified(database).intact

    @pytest.mark.parametrize(
        "statement",
        [
            "UPDATE audit SET who = 'Nobody' WHERE number = 2",
            "DELETE FROM audit WHERE number = 3",
            "DELETE FROM audit",
            "INSERT INTO audit SELECT * FROM audit WHERE number = 1",
            "INSERT OR REPLACE INTO audit SELECT * FROM audit WHERE number = 1",
            "REPLACE INTO audit SELECT * FROM audit WHERE number = 1",
            "TRUNCATE audit",
        ],
    )
    def test_database_only_lets_the_trail_grow(self, chained: Database, statement: str) -> None:
        for n in range(3):
            with chained.write() as session:
                entries.add_entry(session, entries.entry(f"act {n}"))
        with pytest.raises(RefusedError), chained.write() as session:
            session.execute(text(statement))
        assert len(rows(chained)) == 3
        assert verified(chained).intact


class TestQueue:
    @SQLITE_FIRST
    def test_views_are_deduplicated_per_minute_person_action_and_object(
        self, database: Database, tmp_path: Path
    ) -> None:
        async def look() -> None:
            for key in (1, 1, 2, 1):
                with request("get_patient", patient_id=UUID(int=key)):
                    await audit_log.record(entries.entry("get_patient", "done"))
            with request("get_patient", replace(SATO, login_session_id=uuid4()), patient_id=UUID(int=1)):
                await audit_log.record(entries.entry("get_patient", "done"))

        with trail_of(database, tmp_path) as audit_log:
            asyncio.run(look())
            assert audit_log.until_written()
        looks = [row.patient_id and row.patient_id.int for row in rows(database) if row.action == "get_patient"]
        assert looks == [1, 2, 1]
        assert verified(database, tmp_path).intact

    def test_repeated_refusals_are_counted_when_their_minute_ends(self) -> None:
        deduplicator = Deduplicator()
        with request("get_patient", None):
            refused = entries.entry("get_patient", "refused", uuid4(), detail={"code": "not_signed_in"})
            # Without a login, invented ids do not add rows.
            others = [replace(refused, patient_id=uuid4()) for _ in range(3)]
        assert deduplicator.add(refused, 0.0) == [refused]
        assert [deduplicator.add(other, 1.0) for other in others] == [[], [], []]
        (counted,) = deduplicator.expire(WINDOW_S)
        assert json.loads(counted.detail) == {"code": "not_signed_in", "again": 3}
        assert counted.at == others[-1].at
        assert deduplicator.add(refused, WINDOW_S + 1) == [refused]

    def test_views_are_remembered_by_browser_role_and_address(self, monkeypatch: pytest.MonkeyPatch) -> None:
        with request("get_patient", subject="patient"):
            view = entries.entry("get_patient", "done")
        views = RecordedViews()
        views.add(view, b"/api/patients/1?")
        assert (view, b"/api/patients/1?") in views
        assert (view, b"/api/patients/2?") not in views
        assert (replace(view, sign_in_id=uuid4()), b"/api/patients/1?") not in views
        assert (replace(view, role="viewer"), b"/api/patients/1?") not in views
        monkeypatch.setattr(deduplication, "_MAX_VIEWS", 2)
        for number in (2, 1, 3):
            views.add(view, b"/api/patients/%d?" % number)
        assert [(view, b"/api/patients/%d?" % number) in views for number in (1, 2, 3)] == [True, False, True]

    @SQLITE_FIRST
    def test_views_wait_for_a_full_disk_and_device_commands_continue(
        self, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        with trail_of(database, tmp_path) as audit_log:
            assert audit_log.until_written()
            with monkeypatch.context() as patch:
                patch.setattr(EventSpool, "has_room", False)

                async def flood() -> None:
                    answer = [
                        asyncio.create_task(audit_log.record(entries.entry(f"look {n}", "done"))) for n in range(20)
                    ]
                    done, _ = await asyncio.wait(answer, timeout=0.05)
                    assert not done
                    audit_log.record_at_once(entries.entry("stop", "done"))
                    assert await asyncio.to_thread(audit_log.until_written)
                    assert [row.action for row in rows(database)] == ["service_started", "stop"]
                    patch.undo()
                    await asyncio.gather(*answer)

                asyncio.run(flood())
        actions = [row.action for row in rows(database)]
        assert sorted(actions[2:-1]) == sorted(f"look {n}" for n in range(20))
        assert verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_audit_writers_do_not_wait_during_outages_and_keep_order(
        self, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        append, away = chain.append, threading.Event()

        def failing(*given: Any) -> chain.Head:
            if away.is_set():
                raise OperationalError("", None, Exception("locked"))
            return append(*given)

        monkeypatch.setattr(chain, "append", failing)
        with trail_of(database, tmp_path, retry_s=0.01) as audit_log:
            away.set()
            for n in range(20):
                asyncio.run(recorded_in_time(audit_log, entries.entry(f"look {n}", "done")))
            away.clear()
            assert audit_log.until_written()
        answer = [row.action for row in rows(database)]
        assert answer == ["service_started", *(f"look {n}" for n in range(20)), "service_ended"]
        assert verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_temporarily_unwritable_database_loses_no_audit_rows(
        self, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        append, failures = chain.append, iter(range(3))

        def failing(*given: Any) -> chain.Head:
            if next(failures, None) is not None:
                raise OperationalError("", None, Exception("locked"))
            return append(*given)

        with trail_of(database, tmp_path, retry_s=0.01) as audit_log:
            monkeypatch.setattr(chain, "append", failing)
            audit_log.record_at_once(entries.entry("stop", "done"))
            assert audit_log.until_written()
        assert [row.action for row in rows(database)] == ["service_started", "stop", "service_ended"]


class TestAnchor:
    @SQLITE_FIRST
    def test_anchor_follows_every_commit_and_records_the_trail_length(self, database: Database, tmp_path: Path) -> None:
        with trail_of(database, tmp_path) as audit_log:
            assert audit_log.until_written()
            for n in range(3):
                with database.write() as session:
                    session.add(new_patient(f"K-{n}"))
                assert audit_log.until_written()
        lines = anchor.read(tmp_path / "audit.anchor")
        assert [line.head.number for line in lines] == [1, 2, 3, 4, 5]
        assert [row.anchored for row in rows(database)] == [0, 1, 2, 3, 4]
        assert verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_crash_between_commit_and_anchor_is_reported_at_next_start(
        self, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
    ) -> None:
        with trail_of(database, tmp_path):
            pass
        AuditHook(database)
        with database.write() as session:
            session.add(new_patient())
        assert verified(database, tmp_path).intact
        with trail_of(database, tmp_path):
            pass
        again = next(row for row in reversed(rows(database)) if row.action == "service_started")
        assert json.loads(again.detail) == {"not_anchored": 1}
        assert verified(database, tmp_path).intact
        assert not [record for record in caplog.records if record.levelno >= logging.CRITICAL]

    @SQLITE_FIRST
    def test_anchor_line_torn_by_a_power_cut_is_written_past(self, database: Database, tmp_path: Path) -> None:
        with trail_of(database, tmp_path):
            pass
        with (tmp_path / "audit.anchor").open("a") as file:
            file.write('{"line": 3, "anch')
        with trail_of(database, tmp_path):
            pass
        assert [line.line for line in anchor.read(tmp_path / "audit.anchor")] == [1, 2, 3, 4]
        assert verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_unwritable_anchor_disk_delays_no_change(
        self, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
    ) -> None:
        def full(*_: object) -> None:
            raise OSError("no space left on device")

        with trail_of(database, tmp_path) as audit_log:
            assert audit_log.until_written()
            with monkeypatch.context() as patch:
                patch.setattr(anchor.Anchor, "add", full)
                with database.write() as session:
                    session.add(new_patient())
                assert audit_log.until_written()
        assert "anchor cannot be written" in caplog.text
        assert verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_service_reports_a_truncated_trail_in_log_and_trail(
        self, database: Database, tmp_path: Path, caplog: pytest.LogCaptureFixture
    ) -> None:
        with trail_of(database, tmp_path) as audit_log:
            for n in range(4):
                with database.write() as session:
                    entries.add_entry(session, entries.entry(f"act {n}"))
            assert audit_log.until_written()
        without_guards(database)
        with database.writer.begin() as connection:
            connection.execute(delete(AuditRow).where(AuditRow.number > 3))
        with trail_of(database, tmp_path):
            pass
        assert "the anchor has the head" in caplog.text
        assert [row.action for row in rows(database)][3] == "audit_broken"
        assert not verified(database, tmp_path).intact

    @SQLITE_FIRST
    def test_restoring_a_backup_is_recorded_and_is_no_damage(self, database: Database, tmp_path: Path) -> None:
        with trail_of(database, tmp_path) as audit_log:
            for n in range(4):
                with database.write() as session:
                    entries.add_entry(session, entries.entry(f"act {n}"))
            assert audit_log.until_written()
        without_guards(database)
        with database.writer.begin() as connection:
            connection.execute(delete(AuditRow).where(AuditRow.number > 3))
        AuditHook(database)
        with request("restore"), database.write() as session:
            note_restored(session, tmp_path / "audit.anchor", "kata-2026-11-21.age")
        with trail_of(database, tmp_path):
            pass
        verdict = verified(database, tmp_path)
        assert verdict.findings == []
        assert verdict.remarks == ["Row 4: a backup was restored, which discarded the rows since that backup."]
        assert "audit_broken" not in {row.action for row in rows(database)}


def without_guards(database: Database) -> None:
    """Remove the protection of the audit table, as an attacker with full rights on the database can."""
    on_file = database.file is not None
    with database.writer.begin() as connection:
        names = (
            ("audit_grows", "audit_kept_as_it_is", "audit_kept")
            if on_file
            else ("audit_grows", "audit_kept", "audit_kept_whole")
        )
        for name in names:
            connection.execute(text(f"DROP TRIGGER {name}" + ("" if on_file else " ON audit")))
