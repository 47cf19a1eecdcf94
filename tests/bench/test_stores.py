"""A stored benchmark database is used again until its schema or content changes."""

from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from benchmarks.http_load import LISTS, serving
from benchmarks.stores import store
from kata.auth.tables import LoginSessionRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions.tables import SessionRow, SessionStopRow
from kata.clinic.statistics import derived_tables
from kata.clinic.statistics.tables import EpisodeOutcomeRow, StationHourRow
from kata.database.base import Base
from kata.database.engine import Database
from kata.database.upgrade import migrations
from tests.support.databases import upgraded_file

MINUTE_S = 60.0


def rename_patients(database: Database) -> None:
    with database.write() as session:
        for row in session.scalars(select(PatientRow)):
            row.name = "Changed"


def names(database: Database) -> set[str]:
    with database.read() as session:
        return set(session.scalars(select(PatientRow.name)))


def test_stored_benchmark_database_is_reused(tmp_path: Path) -> None:
    with store("sqlite", 4, 8, MINUTE_S, tmp_path) as (database, _, first):
        rename_patients(database)
    with store("sqlite", 4, 8, MINUTE_S, tmp_path) as (database, _, again):
        assert names(database) == {"Changed"}
    assert again == first


@pytest.mark.parametrize("other", ["schema", "hour"])
def test_outdated_benchmark_database_is_rebuilt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: str) -> None:
    with store("sqlite", 4, 8, MINUTE_S, tmp_path) as (database, _, _):
        rename_patients(database)
    if other == "schema":
        (tmp_path / "versions").mkdir()
        for file in (migrations() / "versions").glob("*.py"):
            (tmp_path / "versions" / file.name).write_text(file.read_text() + "# changed")
        monkeypatch.setattr("benchmarks.stores.migrations", lambda: tmp_path)
    with store("sqlite", 4, 8, 2 * MINUTE_S if other == "hour" else MINUTE_S, tmp_path) as (database, _, _):
        assert "Changed" not in names(database)


def test_temporary_benchmark_database_is_deleted() -> None:
    with store("sqlite", 4, 8, MINUTE_S, None) as (_, folder, _):
        assert (folder / "kata.db").exists()
    assert not folder.exists()


def test_quickly_filled_database_equals_a_normally_filled_one(tmp_path: Path) -> None:
    with (
        store("sqlite", 4, 200, MINUTE_S, tmp_path) as (database, _, _),
        database.writer.connect() as connection,
    ):
        indexes = {row[0]: row[1] for row in connection.exec_driver_sql(_SCHEMA)}
        assert connection.exec_driver_sql("PRAGMA foreign_key_check").all() == []
        assert connection.exec_driver_sql("PRAGMA integrity_check").scalar_one() == "ok"
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar_one() == "wal"
        stops = connection.execute(
            select(SessionStopRow.therapist, SessionRow.therapist).join(
                SessionRow, SessionRow.id == SessionStopRow.session_id
            )
        ).all()
    assert stops and all(of_stop == of_session for of_stop, of_session in stops)
    other = Database(upgraded_file(tmp_path / "other.db"))
    with other.writer.connect() as connection:
        assert indexes == {row[0]: row[1] for row in connection.exec_driver_sql(_SCHEMA)}
    other.close()


@pytest.mark.campaign
def test_quickly_filled_figures_are_those_of_the_records(tmp_path: Path) -> None:
    tables = (StationHourRow, EpisodeOutcomeRow)
    with store("sqlite", 4, 200, MINUTE_S, tmp_path) as (database, _, _), database.write() as session:
        made = [figures(session, table) for table in tables]
        hours = {(row.station, row.hour) for row in session.scalars(select(StationHourRow))}
        for table in tables:
            session.execute(delete(table))
        derived_tables.refresh(session, hours, set(), set(session.scalars(select(EpisodeRow.id))))
        computed = [figures(session, table) for table in tables]
    assert all(made) and made == computed


def figures(session: Session, table: type[Base]) -> list[tuple[object, ...]]:
    """Return the rows of a table in order, numbers rounded."""
    rows = session.execute(select(*table.__table__.columns)).all()
    return sorted(tuple(round(value, 6) if isinstance(value, float) else value for value in row) for row in rows)


_SCHEMA = (
    "SELECT name, replace(replace(sql, '\n', ''), '\t', '') FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL"
)


def test_sign_in_of_a_benchmark_stays_unlocked_for_hours(tmp_path: Path) -> None:
    with store("sqlite", 4, 8, MINUTE_S, tmp_path) as (database, folder, history), serving(database, folder) as service:
        with database.write() as session:
            for row in session.scalars(select(LoginSessionRow)):
                row.seen_at -= timedelta(hours=2)
        assert next(service.answers_ms(LISTS[0], history)) > 0.0
