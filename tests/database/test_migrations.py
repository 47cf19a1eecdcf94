"""Databases of every released version with data in every table: upgrade, downgrade, second upgrade, and a kill at every statement."""

import hashlib
import json
import os
import shutil
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any
from uuid import UUID

import numpy as np
import pytest
import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from sqlalchemy import event

from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.patients.sorting import sort_key
from kata.clinic.recordings.tables import RECORDING_COLUMNS, RECORDING_SAMPLES
from kata.clinic.sessions import correction_learning
from kata.clinic.sessions.tables import RUN_COLUMNS, RUN_SAMPLES
from kata.clinic.statistics import derived_tables
from kata.database.arrays import decode, encode
from kata.database.base import UtcDateTime
from kata.database.engine import Database, DatabaseError
from kata.database.series import pack, unpack
from kata.database.upgrade import migrations, upgrade
from tests.support.array_formats import FIRST_FORMAT
from tests.support.treatment import treat

RELEASED = ("0001", "0002", "0003", "0004")
NOW = datetime(2025, 4, 1, 9, 30, 0, 123456, tzinfo=UTC)
LATER = datetime(2025, 4, 1, 10, 15, tzinfo=UTC)
Row = dict[str, Any]
Contents = dict[str, list[Row]]


def key(number: int) -> UUID:
    return UUID(int=number)


def rows_of(version: str) -> list[tuple[str, Row]]:
    """Return two rows of every table of a version, ordered so that references exist when a row is inserted."""
    answer: list[tuple[str, Row]] = []
    for n, side in ((1, "left"), (2, "right")):
        patient = {
            "id": key(n), "clinic_number": f"K-{n}", "name": "Satō Ken", "kana": "サトウ ケン" if n == 1 else None,
            "birth_date": date(1950, 2, 28), "sex": "male", "affected_side": side, "notes": "Plays the violin.",
            "created_at": NOW, "updated_at": LATER, "archived_at": LATER if n == 2 else None,
        }  # fmt: skip
        visit = {
            "id": key(10 + n), "patient_id": key(n), "started_at": NOW, "ended_at": LATER if n == 1 else None,
            "note": "Went well.",
        }  # fmt: skip
        teaching = {"id": key(20 + n), "patient_id": key(n), "name": "Lift", "side": side, "started_at": NOW}
        recording = {
            "id": key(30 + n), "patient_id": key(n), "teaching_id": key(20 + n), "take": 1, "name": "Lift",
            "side": side, "station": "Station 1", "taught_at": NOW, "duration_s": 1.25, "rate_hz": 100, "samples": 126,
            "note": "", "archived_at": None,
        }  # fmt: skip
        run = {
            "id": key(40 + n), "session_id": key(10 + n), "recording_id": key(30 + n), "started_at": NOW,
            "ended_at": LATER, "outcome": "stopped" if n == 1 else "completed",
            "stop_code": "estop_pressed" if n == 1 else None, "stop_message": "Pressed." if n == 1 else None,
            "rate_hz": 100, "samples": 126,
        }  # fmt: skip
        tracking = {"run_id": key(40 + n), "peak_deg": -2.5, "peak_at_s": 0.5, "rmse_deg": 0.75, "start_deg": 0.0}
        if version >= "0002":
            run |= {"load_level": 8 if n == 1 else None}
        figures = {"lag_ms": 51.5, "taught_min_deg": -1.0} | dict.fromkeys(
            ("taught_max_deg", "played_min_deg", "played_max_deg", "taught_smoothness", "played_smoothness")
        )
        if version >= "0003":
            run |= {
                "speed_percent": 80.0, "repetitions": 3, "pause_s": 1.5, "range_percent": 90.0, "method": "learned",
                "corrected_by": key(41) if n == 2 else None,
            }  # fmt: skip
        if version >= "0004":
            recording |= {"parent_id": None, "done": []}
        answer += [("patients", patient), ("sessions", visit), ("teachings", teaching), ("recordings", recording)]
        # Given: a readable series, and a damaged one.
        answer.append(
            ("recording_samples", {"recording_id": key(30 + n), "data": FIRST_FORMAT[: 1000 if n == 1 else 40]})
        )
        answer.append(("runs", run))
        motor = tracking | {"motor": 3} | (figures | {"torque_peak_nm": 1.5} if version >= "0003" else {})
        answer += [("motor_tracking", motor), ("run_samples", {"run_id": key(40 + n), "data": FIRST_FORMAT})]
        if version >= "0003":
            answer.append(("motion_tracking", tracking | figures | {"motion": 4}))
            answer.append(("run_corrections", {"run_id": key(40 + n), "station": "Station 1", "data": FIRST_FORMAT}))
        if version >= "0004":
            derived = {"id": key(50 + n), "teaching_id": None, "take": None, "parent_id": key(30 + n)}
            answer.append(("recordings", recording | derived | {"done": ["trimmed", "mirrored"]}))
            answer.append(("recording_samples", {"recording_id": key(50 + n), "data": FIRST_FORMAT}))
    return answer


def kind(name: str) -> Any:
    """Return the type of a column from its name. These tests do not use the present classes."""
    if name in ("id", "corrected_by") or name.endswith("_id"):
        return sa.Uuid()
    if name.endswith("_at"):
        return sa.DateTime(timezone=True)
    return {"data": sa.LargeBinary(), "done": sa.JSON(), "birth_date": sa.Date()}.get(name, sa.types.NullType())


def at_version(database: Database, version: str, move: Callable[[Config, str], None] = command.upgrade) -> None:
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    with database.writer.connect() as connection:
        config.attributes["connection"] = connection
        move(config, version)


def filled(database: Database, version: str) -> None:
    """Return a database of this version with two rows in every table."""
    at_version(database, version)
    answer = rows_of(version)
    with database.writer.begin() as connection:
        for table, row in answer:
            connection.execute(sa.insert(sa.table(table, *(sa.column(name, kind(name)) for name in row))), [row])
        tables = set(sa.inspect(connection).get_table_names()) - {"alembic_version"}
    assert tables == {table for table, _ in answer}


def contents(database: Database) -> Contents:
    """Return all rows as the database returns them, without the ids that an upgrade creates."""
    kept: Contents = {}
    with database.writer.connect() as connection:
        for table in sorted(sa.inspect(connection).get_table_names()):
            rows = connection.exec_driver_sql(f"SELECT * FROM {table}").mappings().all()
            made_up = {"episode_id"} | ({"id"} if table == "episodes" else set())
            plain = [{name: value for name, value in row.items() if name not in made_up} for row in rows]
            kept[table] = sorted(plain, key=repr)
    return kept


@pytest.fixture(params=["sqlite", "postgresql"])
def empty(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """Return a database without tables."""
    on_file = request.param == "sqlite"
    made = Database(f"sqlite:///{tmp_path / 'kata.db'}" if on_file else request.getfixturevalue("postgresql_url"))
    yield made
    if not on_file:
        emptied(made)
    made.close()


def emptied(database: Database) -> None:
    with database.writer.begin() as connection:
        connection.exec_driver_sql("DROP SCHEMA public CASCADE")
        connection.exec_driver_sql("CREATE SCHEMA public")


# In every run the first version, which takes every migration, and the last, which has the columns of the versions between.
@pytest.mark.parametrize(
    "version",
    [
        pytest.param(version, marks=[] if version in (RELEASED[0], RELEASED[-1]) else [pytest.mark.campaign])
        for version in RELEASED
    ],
)
def test_data_of_every_released_version_upgrades_and_downgrades(empty: Database, version: str) -> None:
    filled(empty, version)
    before = contents(empty)
    upgrade(empty)
    upgraded = contents(empty)
    assert {table: len(rows) for table, rows in upgraded.items() if table in before} == {
        table: len(rows) for table, rows in before.items()
    }
    with empty.read() as session:
        assert decode(RECORDING_SAMPLES.read(session, key(31)).head)["path_s"][4] == 5.0
        assert unpack(RUN_SAMPLES.read(session, key(42)))["path_s"][4] == 5.0
    assert sorted(row["side"] for row in upgraded["episodes"]) == ["left", "right"]
    assert sorted(row["run_count"] for row in upgraded["sessions"]) == [1, 1]
    assert [row["code"] for row in upgraded["session_stops"]] == ["estop_pressed"]

    at_version(empty, version, command.downgrade)
    assert contents(empty) == before
    upgrade(empty)
    assert contents(empty) == upgraded


def test_upgrade_takes_errors_with_reduced_range_out_of_charts(empty: Database) -> None:
    filled(empty, "0004")
    at_version(empty, "0010")
    with empty.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE runs SET worst_rmse_deg = 0.75, worst_peak_deg = 2.5")
        connection.exec_driver_sql("UPDATE runs SET least_range_percent = 60 WHERE outcome = 'stopped'")
    before = contents(empty)
    upgrade(empty)
    found = {row["outcome"]: (row["worst_rmse_deg"], row["worst_peak_deg"]) for row in contents(empty)["runs"]}
    assert found == {"stopped": (None, None), "completed": (0.75, 2.5)}
    assert [row["peak_deg"] for row in contents(empty)["motor_tracking"]] == [-2.5, -2.5]
    at_version(empty, "0010", command.downgrade)
    assert contents(empty) == before


def test_upgrade_sums_whole_motions_between_the_midnights_of_zones(empty: Database) -> None:
    """The sums of 0036 are hours and include a playback that was stopped in its first repetition."""
    filled(empty, "0004")
    at_version(empty, "0036")
    with empty.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE sessions SET station = 'Kata 1'")
        connection.exec_driver_sql("UPDATE runs SET worst_rmse_deg = 0.75, worst_peak_deg = 2.5")
        connection.exec_driver_sql("UPDATE runs SET repetitions_done = 0 WHERE outcome = 'stopped'")
        sessions = sa.table("sessions", sa.column("id", sa.Uuid()), sa.column("started_at", UtcDateTime()))
        for n, minute in ((11, 20), (12, 40)):
            at = datetime(2025, 4, 1, 18, minute, tzinfo=UTC)
            connection.execute(sa.update(sessions).where(sessions.c.id == key(n)).values(started_at=at))
    upgrade(empty)
    found = [(str(row["hour"])[11:16], row["compared"], row["left_out"]) for row in station_hours(empty)]
    assert found == [("18:15", 0, 1), ("18:30", 1, 0)]
    with empty.write() as session:
        derived_tables.refresh(session, set(), {key(11), key(12)}, set())
    assert [(str(row["hour"])[11:16], row["compared"], row["left_out"]) for row in station_hours(empty)] == found
    at_version(empty, "0036", command.downgrade)
    assert [(str(row["hour"])[11:16], row["compared"]) for row in station_hours(empty)] == [("18:00", 2)]
    assert [row["worst_rmse_deg"] for row in contents(empty)["runs"]] == [0.75, 0.75]


def test_outcomes_of_an_episode_become_one_row_and_measures_again(empty: Database) -> None:
    upgrade(empty)
    derived_tables.DerivedTablesHook(empty)
    with empty.write() as session:
        for sessions in range(2):
            treat(session, sessions=sessions)
    stored = contents(empty)["episode_outcomes"]
    assert len(stored) == 2
    at_version(empty, "0038", command.downgrade)
    rows = contents(empty)["episode_outcomes"]
    important = {row["measure"]: (row["first"], row["last"], row["important_at"] == row["last_at"]) for row in rows}
    assert important["spadi"] == (60.0, 40.0, True)
    assert important["flexion"][2] is False
    at_version(empty, "0039")
    assert contents(empty)["episode_outcomes"] == stored


def test_patients_of_every_version_get_their_place_in_lists(empty: Database) -> None:
    filled(empty, "0004")
    upgrade(empty)
    rows = contents(empty)["patients"]
    assert [row["sort_key"] for row in rows] == [sort_key(row["name"], row["kana"]) for row in rows]
    at_version(empty, "0039", command.downgrade)
    with empty.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE patients SET name = '佐藤 健', kana = 'ガートウ ｹﾝ'")
    upgrade(empty)
    assert {row["sort_key"] for row in contents(empty)["patients"]} == {sort_key("佐藤 健", "ガートウ ｹﾝ")}


def station_hours(database: Database) -> list[Row]:
    return sorted(contents(database)["station_hours"], key=lambda row: str(row["hour"]))


def test_stopped_session_is_stored_beside_its_cause(empty: Database) -> None:
    filled(empty, "0004")
    at_version(empty, "0006")
    with empty.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE sessions SET therapist = 'Sato', station = 'Station 1'")
    upgrade(empty)
    [stop] = contents(empty)["session_stops"]
    assert (stop["code"], stop["therapist"], stop["station"]) == ("estop_pressed", "Sato", "Station 1")


# Python converts the samples. The test above downgrades on PostgreSQL in every run.
@pytest.mark.parametrize("empty", ["sqlite", pytest.param("postgresql", marks=pytest.mark.campaign)], indirect=True)
def test_downgrade_removes_new_data_and_preserves_old_data(empty: Database) -> None:
    filled(empty, "0004")
    before = contents(empty)
    upgrade(empty)
    today = _today(empty)
    at_version(empty, "0004", command.downgrade)
    after = contents(empty)

    new = {"recording_samples", "run_samples", "run_corrections"}
    assert {table: rows for table, rows in after.items() if table not in new} == {
        table: rows for table, rows in before.items() if table not in new
    }
    for table, whose, values in today:
        with empty.writer.connect() as connection:
            rows = sa.table(table, sa.column(whose[0], sa.Uuid()), sa.column("data", sa.LargeBinary()))
            data = connection.execute(sa.select(rows.c.data).where(rows.c[whose[0]] == whose[1])).scalar_one()
        assert json.loads(data.partition(b"\n")[0])["format"] == "kata-samples/1"
        back = decode(data)
        for name, expected in values.items():
            assert back[name] == pytest.approx(expected, abs=1.1e-4, nan_ok=True)


def _today(database: Database) -> list[tuple[str, tuple[str, UUID], dict[str, Any]]]:
    """Replace the former samples by present ones, and add a row to each new table."""
    times_s = np.arange(13_000) * 0.01
    taught = {"time_s": times_s, "angle_deg": np.rint(np.sin(times_s[:, None] * np.arange(1, 6)) * 400) * 360 / 4096}
    angles = taught["angle_deg"]
    played = {
        "time_s": times_s, "phase": np.full(13_000, 2.0), "path_s": np.where(times_s < 1, np.nan, times_s),
        "setpoint_deg": np.rint(angles * 500) / 500, "measured_deg": angles, "torque_nm": angles / 100,
    }  # fmt: skip
    learned = {
        "time_s": times_s[:100], "correction_deg": angles[:100] / 1000, "played_deg": angles[:100] / 2000,
        "error_deg": np.full((100, 5), 0.2), "gain": np.full(100, 0.6), "fell_back": np.zeros((100, 5)),
        "total_deg": np.full(100, 0.2), "peak_deg": np.full((100, 5), 0.3),
    }  # fmt: skip
    with database.writer.begin() as connection:
        connection.exec_driver_sql("DELETE FROM recording_samples WHERE recording_id IN (SELECT id FROM recordings)")
        connection.exec_driver_sql("DELETE FROM run_samples")
        connection.exec_driver_sql("DELETE FROM run_corrections")
    with database.write() as session:
        for number in (31, 32, 51, 52):
            RECORDING_SAMPLES.store(session, key(number), pack(taught, RECORDING_COLUMNS), b"overview")
        RUN_SAMPLES.store(session, key(41), pack(played, RUN_COLUMNS), None)
        correction = sa.table(
            "run_corrections", *(sa.column(name, kind(name)) for name in ("run_id", "station", "data"))
        )
        data = encode(learned, correction_learning.COLUMNS)
        session.execute(sa.insert(correction), [{"run_id": key(41), "station": "Station 1", "data": data}])
        episode = session.scalar(sa.text("SELECT id FROM episodes LIMIT 1"))
        for table, more in (
            ("stages", "id, episode_id, stage, since, noted_at"),
            ("programmes", "id, episode_id, name, created_at, updated_at"),
        ):
            values = {"id": key(60).hex, "episode": episode, "now": NOW.isoformat()}
            given = "'x', '2025-04-01', :now" if table == "stages" else "'x', :now, :now"
            session.execute(sa.text(f"INSERT INTO {table} ({more}) VALUES (:id, :episode, {given})"), values)
    return [
        ("recording_samples", ("recording_id", key(31)), taught),
        ("run_samples", ("run_id", key(41)), played),
        ("run_corrections", ("run_id", key(41)), learned),
    ]


def test_newer_database_is_refused_and_left_unchanged(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    filled(database, "0004")
    with database.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    before = contents(database)
    with pytest.raises(DatabaseError, match="written by a newer version of Kata"):
        upgrade(database)
    assert contents(database) == before
    assert [path.name for path in tmp_path.glob("*version*")] == []


def newer(database: Database, revision: str, oldest: str, *statements: str) -> None:
    """Change the database like one of the next two versions of the program."""
    with database.writer.begin() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
        connection.exec_driver_sql(f"INSERT INTO schemas (revision, oldest) VALUES ('{revision}', '{oldest}')")
        connection.exec_driver_sql(f"UPDATE alembic_version SET version_num = '{revision}'")


def test_older_station_continues_beside_a_newer_programs_additions(empty: Database) -> None:
    upgrade(empty)
    newer(
        empty, "0999", "0007",
        "ALTER TABLE device_events ADD COLUMN weather VARCHAR(20)",
        "ALTER TABLE patients ADD COLUMN shoe_size INTEGER DEFAULT 0 NOT NULL",
    )  # fmt: skip
    upgrade(empty)
    with empty.writer.connect() as connection:
        assert connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar_one() == "0999"
    with empty.write() as session:
        patient = patients.create(session, PatientCreate(clinic_number="1", name="N", affected_side="left"))
    with empty.read() as session:
        assert patients.get(session, patient.id).name == "N"


def test_newer_database_with_removals_is_refused_by_older_programs(empty: Database) -> None:
    upgrade(empty)
    newer(empty, "1000", "0999", "DROP TABLE spools")
    with pytest.raises(DatabaseError, match="written by a newer version of Kata"):
        upgrade(empty)


def test_each_new_migration_names_compatible_programs(empty: Database) -> None:
    upgrade(empty)
    present = max(file.name[:4] for file in (migrations() / "versions").glob("*.py"))
    with empty.read() as session:
        oldest = session.scalar(sa.text("SELECT oldest FROM schemas ORDER BY revision DESC LIMIT 1"))
        newest = session.scalar(sa.text("SELECT max(revision) FROM schemas"))
    assert newest == present
    assert oldest is not None
    assert oldest <= present


def test_program_without_speed_limits_refuses_a_database_with_them(empty: Database) -> None:
    upgrade(empty)
    with empty.writer.connect() as connection:
        oldest = connection.exec_driver_sql("SELECT oldest FROM schemas WHERE revision = '0008'").scalar_one()
    assert oldest == "0008"


def test_file_is_copied_before_upgrade_and_two_copies_remain(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    for version in RELEASED[1:]:
        filled(database, version) if version == "0002" else at_version(database, version, command.downgrade)
        before = contents(database)
        upgrade(database)
        copy = Database(f"sqlite:///{tmp_path / f'kata.db.version-{version}'}")
        assert contents(copy) == before
        copy.close()
    database.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "kata.db",
        "kata.db.version-0003",
        "kata.db.version-0004",
    ]


def test_upgrade_without_free_space_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    filled(database, "0004")
    before = contents(database)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 1000))
    with pytest.raises(DatabaseError, match="free up space, then start again"):
        upgrade(database)
    assert contents(database) == before


def statements(database: Database, at: Callable[[int], None]) -> None:
    """Call ``before`` with each SQL statement before it is executed."""
    count = 0

    def about_to(*_: object) -> None:
        nonlocal count
        at(count)
        count += 1

    event.listen(database.writer, "before_cursor_execute", about_to)


@pytest.mark.campaign
def test_every_upgrade_statement_leaves_a_whole_version_on_disk(tmp_path: Path) -> None:
    """A killed process leaves its files as they are at that moment."""
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    filled(database, "0001")
    whole = {"0001": contents(database)}
    database.close()
    shutil.copy(tmp_path / "kata.db", tmp_path / "step.db")
    step = Database(f"sqlite:///{tmp_path / 'step.db'}")
    for version in sorted(path.name[:4] for path in migrations().glob("versions/0*.py"))[1:]:
        at_version(step, version)
        whole[version] = contents(step)
    step.close()

    left: dict[str, Path] = {}
    taken = 0

    def keep(n: int) -> None:
        nonlocal taken
        taken += 1
        parts = [
            (end, (tmp_path / f"kata.db{end}").read_bytes())
            for end in ("", "-wal")
            if (tmp_path / f"kata.db{end}").exists()
        ]
        name = hashlib.sha256(repr(parts).encode()).hexdigest()
        if name not in left:
            left[name] = tmp_path / f"left-{n}.db"
            for end, data in parts:
                left[name].with_name(left[name].name + end).write_bytes(data)

    statements(database, keep)
    upgrade(database)
    assert taken > 200
    versions = set()
    for path in left.values():
        found = Database(f"sqlite:///{path}")
        answer = contents(found)
        version = answer["alembic_version"][0]["version_num"]
        assert answer == whole[version]
        with closing(sqlite3.connect(path)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        found.close()
        versions.add(version)
    assert versions >= {"0001", "0002", "0003", "0004", "0005"}


def killed_at(url: str, statement: int) -> None:
    """Upgrade in a separate process, and kill it before a statement."""
    child = os.fork()
    if child == 0:
        try:
            database = Database(url)
            statements(database, lambda n: os.kill(os.getpid(), signal.SIGKILL) if n == statement else None)
            upgrade(database)
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL


@pytest.mark.parametrize("backend", [pytest.param("sqlite", marks=pytest.mark.campaign), "postgresql"])
def test_killed_upgrade_restarts_to_the_same_database(
    backend: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    on_file = backend == "sqlite"

    def fresh(name: str) -> str:
        return f"sqlite:///{tmp_path / name}" if on_file else str(request.getfixturevalue("postgresql_url"))

    reference = Database(fresh("whole.db"))
    count = 0

    def counted(n: int) -> None:
        nonlocal count
        count = n

    filled(reference, "0001")
    statements(reference, counted)
    upgrade(reference)
    last = count
    expected = contents(reference)
    for statement in (last // 2, last - 20, last) if on_file else (last // 2, last):
        if not on_file:
            emptied(reference)
        url = fresh(f"killed-{statement}.db")
        database = Database(url)
        filled(database, "0001")
        database.close()
        killed_at(url, statement)
        upgrade(database)
        assert contents(database) == expected, statement
        database.close()
    if not on_file:
        emptied(reference)
    reference.close()
