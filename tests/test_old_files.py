"""Today's code reads database, anchor, journal, spool and backup of Kata before its modules and names were changed.

``tests/support/old_files.py`` produced the files and says from which commit.
"""

import sqlite3
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from kata.audit.tables import AuditRow
from kata.audit.verify import verify
from kata.backups.restore import restore_backup
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RunRow
from kata.database.engine import Database
from kata.settings import Settings
from tests.support.archives import unpack
from tests.support.paths import ROOT
from tests.support.service import running

ARCHIVE = ROOT / "tests/fixtures/old_clinic.tar.xz"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    unpack(ARCHIVE, tmp_path / "old")
    return tmp_path / "old"


def count(file: Path, table: str, where: str = "TRUE") -> int:
    database = sqlite3.connect(file)
    try:
        (number,) = database.execute(f"SELECT count(*) FROM {table} WHERE {where}").fetchone()
        return int(number)
    finally:
        database.close()


def test_old_files_hold_an_undelivered_run(old: Path) -> None:
    assert count(old / "kata.db", "alembic_version", "version_num = '0008'") == 1
    assert (count(old / "kata.db", "runs"), count(old / "kata.db", "runs", "ended_at IS NULL")) == (2, 1)
    assert len(list((old / "journal").glob("run-*.journal"))) == 1


def test_service_migrates_imports_and_delivers_old_files(old: Path) -> None:
    events, audited = count(old / "kata.db", "device_events"), count(old / "kata.db", "audit")
    with running(old, simulate=False) as client:
        app: Any = client.app
        services = app.state.services
        assert services.event_spool.until_taken(30.0)
        with services.database.read() as session:
            first, second = session.scalars(select(RunRow).order_by(RunRow.started_at))
            assert first.outcome == second.outcome == "completed"
            for run in (first, second):
                samples, taught = runs.samples(session, run.id), recordings.samples(session, run.recording_id)
                assert len(samples["time_s"]) > 40
                assert len(taught.times_s) > 40
            assert len(session.scalars(select(DeviceEventRow)).all()) > events
            assert len(session.scalars(select(AuditRow)).all()) > audited
            assert verify(session, [old / "audit.anchor"]).findings == []
        for path in (f"/api/sessions/{first.session_id}", f"/api/runs/{second.id}", "/api/audit", "/api/events"):
            assert client.get(path).status_code == 200, path
    assert list((old / "journal").glob("run-*.journal")) == []


def test_old_backup_is_restored(old: Path, tmp_path: Path) -> None:
    (backup,) = (old / "backups").iterdir()
    settings = Settings(data=tmp_path / "new")
    restored = restore_backup(settings, backup, old / "backup-key.txt")
    assert restored.contents.tables["runs"].rows == 1
    database = Database(settings.effective_database_url)
    with database.read() as session:
        (run,) = session.scalars(select(RunRow))
        assert len(runs.samples(session, run.id)["time_s"]) > 40
    database.close()
    assert count(tmp_path / "new/kata.db", "alembic_version", "version_num = '0008'") == 0
