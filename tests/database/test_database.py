"""Engine, column types and upgrade."""

import gc
from contextlib import suppress
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from threading import Event, Thread
from uuid import UUID, uuid4

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import inspect, text
from sqlalchemy.exc import IntegrityError, OperationalError, StatementError
from sqlalchemy.orm import Session

import kata.clinic.tables
from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings.tables import RecordingRow, RecordingSamplesRow, TeachingRow
from kata.clinic.sessions.tables import MotorTrackingRow, RunRow, SessionRow
from kata.database.base import Base
from kata.database.engine import Database, DatabaseError
from kata.database.upgrade import migrations, upgrade

_NOW = datetime.now(UTC)


def _patient(number: str, created_at: datetime | None = None) -> PatientRow:
    now = created_at or datetime.now(UTC)
    return PatientRow(
        id=uuid4(), clinic_number=number, name="N", sex="unknown", notes="",
        created_at=now, updated_at=now,
    )  # fmt: skip


def test_the_migrations_make_the_tables_that_the_program_expects(database: Database) -> None:
    assert kata.clinic.tables.__all__
    with database.writer.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_down_and_up_again(database: Database) -> None:
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    with database.writer.connect() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "base")
        assert inspect(connection).get_table_names() == ["alembic_version"]
        connection.rollback()
        command.upgrade(config, "head")
        assert "patients" in inspect(connection).get_table_names()


def test_run_older_than_resistance_levels_has_no_settings(database: Database) -> None:
    taught = {"taught_at": _NOW, "duration_s": 1.0, "rate_hz": 100, "samples": 101, "archived_at": None}
    played = {"started_at": _NOW, "ended_at": _NOW, "stop_code": None, "stop_message": None, "rate_hz": 100}
    tracked = {"peak_deg": 1.0, "peak_at_s": 0.5, "rmse_deg": 0.2, "start_deg": 0.0}
    with database.write() as session:
        session.add(patient := _patient("1"))
        session.add(visit := SessionRow(id=uuid4(), patient_id=patient.id, started_at=_NOW, ended_at=None, note=""))
        fields = {"patient_id": patient.id, "name": "N", "side": "left"}
        session.add(teaching := TeachingRow(id=uuid4(), started_at=_NOW, **fields))
        session.flush()
        session.add(
            recording := RecordingRow(
                id=uuid4(), teaching_id=teaching.id, take=1, station="S", note="", **fields, **taught
            )
        )
        session.flush()
        session.add(
            run := RunRow(
                id=uuid4(), session_id=visit.id, recording_id=recording.id, outcome="completed", resistance_level=8,
                samples=100, **played,
            )
        )  # fmt: skip
        session.flush()
        session.add(MotorTrackingRow(run_id=run.id, motor=1, **tracked))
        key = run.id
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    with database.writer.connect() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0001")
        assert "load_level" not in {column["name"] for column in inspect(connection).get_columns("runs")}
        connection.rollback()
    upgrade(database)

    with database.read() as session:
        stored = session.get_one(RunRow, key)
        assert (stored.outcome, stored.samples, len(stored.tracking)) == ("completed", 100, 1)
        assert stored.resistance_level is None
        assert (stored.method, stored.corrected_by) == (None, None)
        assert (stored.repetitions_done, stored.played_s) == (1, 1.0)
        # Old runs were played once, as taught. Values that were not computed then are unknown.
        assert (stored.speed_percent, stored.repetitions, stored.pause_s, stored.range_percent) == (
            100.0,
            1,
            0.0,
            100.0,
        )
        assert (stored.tracking[0].peak_deg, stored.tracking[0].lag_ms, stored.tracking[0].torque_peak_nm) == (
            1.0,
            None,
            None,
        )


def test_derived_recording_downgrades_to_a_take_without_loss(database: Database) -> None:
    fields = {"name": "N", "side": "left"}
    row = {"station": "S", "duration_s": 1.0, "rate_hz": 100, "samples": 101, "note": "", "archived_at": None, **fields}
    with database.write() as session:
        session.add(patient := _patient("1"))
        session.flush()
        teaching = TeachingRow(id=uuid4(), patient_id=patient.id, started_at=_NOW, **fields)
        visit = SessionRow(id=uuid4(), patient_id=patient.id, started_at=_NOW, ended_at=None, note="")
        session.add_all([teaching, visit])
        session.flush()

        def stored_recording(minutes: int, **given: object) -> UUID:
            made = RecordingRow(
                id=uuid4(), patient_id=patient.id, taught_at=_NOW + timedelta(minutes=minutes), **row, **given
            )
            session.add(made)
            session.flush()
            session.add(RecordingSamplesRow(recording_id=made.id, data=b"samples"))
            return made.id

        first = stored_recording(0, teaching_id=teaching.id, take=1)
        third = stored_recording(1, teaching_id=teaching.id, take=3)
        once = stored_recording(2, parent_id=first, done=["trimmed"])
        twice = stored_recording(3, parent_id=once, done=["trimmed", "mirrored"])
        played = {"started_at": _NOW, "ended_at": _NOW, "stop_code": None, "stop_message": None, "rate_hz": 100}
        run = RunRow(
            id=uuid4(),
            session_id=visit.id,
            recording_id=twice,
            outcome="completed",
            resistance_level=8,
            samples=1,
            **played,
        )
        session.add(run)
        runs = run.id
    with database.read() as session:
        assert session.get_one(RecordingRow, first).done == []
        assert session.get_one(RecordingRow, twice).done == ["trimmed", "mirrored"]
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    with database.writer.connect() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0003")
        takes = connection.execute(text("SELECT take FROM recordings ORDER BY taught_at")).scalars().all()
        assert takes == [1, 3, 4, 5]
        assert not {"parent_id", "done"} & {column["name"] for column in inspect(connection).get_columns("recordings")}
        connection.rollback()
    upgrade(database)

    with database.read() as session:
        assert session.get_one(RunRow, runs).recording.id == twice
        rows = [session.get_one(RecordingRow, key) for key in (first, third, once, twice)]
        assert [(row.teaching_id, row.take, row.parent_id, row.done) for row in rows] == [
            (teaching.id, take, None, []) for take in (1, 3, 4, 5)
        ]
        assert session.get_one(RecordingSamplesRow, twice).data == b"samples"


def test_recording_must_have_an_existing_parent(database: Database) -> None:
    with database.write() as session:
        session.add(patient := _patient("1"))
    orphan = RecordingRow(
        id=uuid4(), patient_id=patient.id, parent_id=uuid4(), name="N", side="left", station="S", taught_at=_NOW,
        duration_s=1.0, rate_hz=100, samples=101, note="", archived_at=None,
    )  # fmt: skip
    with pytest.raises(IntegrityError), database.write() as session:
        session.add(orphan)


def test_upgrading_twice_changes_nothing(database: Database) -> None:
    with database.write() as session:
        session.add(_patient("1"))
    upgrade(database)
    with database.read() as session:
        assert session.query(PatientRow).count() == 1


def test_a_database_of_a_newer_program_is_left_alone(database: Database) -> None:
    with database.writer.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(DatabaseError, match="written by a newer version of Kata"):
        upgrade(database)


def test_file_that_is_no_database_is_refused(tmp_path: Path) -> None:
    (tmp_path / "kata.db").write_text("this text is no database")
    with pytest.raises(DatabaseError, match="cannot be opened"):
        upgrade(Database(f"sqlite:///{tmp_path / 'kata.db'}"))


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("our database", "is not a database URL that Kata supports"),
        ("postgresql+nodriver://h/d", "is not a database URL that Kata supports"),
        ("mysql+pymysql://h/d", "driver is not installed"),
    ],
)
def test_unusable_database_url_is_explained(url: str, sentence: str) -> None:
    with pytest.raises(DatabaseError, match=sentence):
        Database(url)


def test_times_come_back_as_the_same_moment_in_utc(database: Database) -> None:
    tokyo = datetime(2026, 11, 21, 9, 30, 0, 123456, tzinfo=timezone(timedelta(hours=9)))
    row = _patient("1", created_at=tokyo)
    key: UUID = row.id
    with database.write() as session:
        session.add(row)
    with database.read() as session:
        stored = session.get_one(PatientRow, key).created_at
    assert stored == tokyo
    assert stored.tzinfo is UTC


def test_a_time_without_a_zone_is_refused(database: Database) -> None:
    with pytest.raises(StatementError, match="without a time zone"), database.write() as session:
        session.add(_patient("1", created_at=datetime(2026, 1, 1)))  # noqa: DTZ001


def test_failed_transaction_leaves_nothing_behind(database: Database) -> None:
    def half_done() -> None:
        with database.write() as session:
            session.add(_patient("1"))
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        half_done()
    with database.read() as session:
        assert session.query(PatientRow).count() == 0


class TestSqlite:
    @pytest.fixture
    def database(self, tmp_path: Path) -> Database:
        made = Database(f"sqlite:///{tmp_path / 'kata.db'}")
        upgrade(made)
        return made

    @pytest.mark.parametrize(("pragma", "value"), [("journal_mode", "wal"), ("synchronous", 2), ("foreign_keys", 1)])
    def test_is_set_up_to_survive_a_pulled_plug(self, database: Database, pragma: str, value: object) -> None:
        for engine in (database.reader, database.writer):
            with engine.connect() as connection:
                assert connection.exec_driver_sql(f"PRAGMA {pragma}").scalar() == value

    def test_connection_keeps_small_caches(self, database: Database) -> None:
        def prepared() -> int:
            gc.collect()
            return sum(type(thing).__name__ == "Statement" for thing in gc.get_objects())

        with database.writer.connect() as connection:
            assert connection.exec_driver_sql("PRAGMA cache_size").scalar() == -512
        with database.reader.connect() as connection:
            before = prepared()
            for number in range(100):
                connection.exec_driver_sql(f"SELECT {number}")
            assert prepared() - before <= 32

    def test_readers_cannot_write_and_do_not_checkpoint(self, database: Database) -> None:
        with Session(database.reader) as session:
            assert session.execute(text("PRAGMA wal_autocheckpoint")).scalar() == 0
            session.add(_patient("1"))
            with pytest.raises(OperationalError, match="readonly"):
                session.flush()

    def test_last_closing_reader_leaves_the_log_to_the_next_writer(self, database: Database, tmp_path: Path) -> None:
        """SQLite before 3.51.3 can corrupt a log when two connections write and checkpoint. Only one connection may do so."""
        file, log = tmp_path / "kata.db", tmp_path / "kata.db-wal"
        with database.write() as session:
            session.add(_patient("1"))
        with database.read() as session:
            assert session.query(PatientRow).count() == 1
            database.writer.dispose()
            before = file.read_bytes(), log.read_bytes()
        database.reader.dispose()
        assert (file.read_bytes(), log.read_bytes()) == before
        with database.write() as session:
            session.add(_patient("2"))
        with database.read() as session:
            assert session.query(PatientRow).count() == 2
        database.close()
        assert not log.exists()

    @pytest.mark.parametrize("pragma", ["wal_checkpoint", "wal_checkpoint(TRUNCATE)", "journal_mode = DELETE"])
    def test_reader_cannot_run_a_checkpoint(self, database: Database, tmp_path: Path, pragma: str) -> None:
        with database.write() as session:
            session.add(_patient("1"))
        before = (tmp_path / "kata.db").read_bytes()
        with database.reader.connect() as connection, suppress(OperationalError):
            connection.exec_driver_sql(f"PRAGMA {pragma}")
        assert (tmp_path / "kata.db").read_bytes() == before

    def test_one_writer_works_and_the_next_one_waits(self, database: Database) -> None:
        began, second_done = Event(), Event()

        def second() -> None:
            began.set()
            with database.write() as session:
                session.add(_patient("2"))
            second_done.set()

        with database.write() as session:
            session.add(_patient("1"))
            session.flush()
            Thread(target=second).start()
            assert began.wait(5)
            assert not second_done.is_set()
        assert second_done.wait(5)
        with database.read() as session:
            assert session.query(PatientRow).count() == 2


def test_size_and_kind_are_known_on_both_databases(database: Database) -> None:
    assert database.kind == database.url.get_backend_name()
    assert database.size_bytes() > 8192
