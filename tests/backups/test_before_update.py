"""The data of before an update: saved, put back, and whole when a put-back is killed at any change."""

import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final
from uuid import uuid4

import pytest
from sqlalchemy import select

from kata.actor import Actor
from kata.audit.audit_log import AuditHook
from kata.audit.entries import add_entry, entry
from kata.audit.tables import AuditRow
from kata.auth.tables import LoginSessionRow
from kata.backups.before_update import put_back, save
from kata.backups.folder import claimed_by_service
from kata.backups.key import BackupError
from kata.database.engine import Database
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.login import signed_in
from tests.support.patients import add_patient, clinic_numbers

SATO: Final = Actor(uuid4(), uuid4(), "Sato", "therapist", frozenset())
_CHANGES: Final = range(1, 12)
_PUT_BACK_KILLED: Final = """
import os, signal, sys
from pathlib import Path
from kata.backups.before_update import put_back
from kata.settings import Settings

changes = 0


def kill(event, arguments):
    global changes
    if event in ("os.rename", "os.link", "sqlite3.connect", "os.remove"):
        changes += 1
        if changes == last:
            os.kill(os.getpid(), signal.SIGKILL)


for last, folder in enumerate(sys.argv[1:], start=1):
    if not (child := os.fork()):
        sys.addaudithook(kill)
        put_back(Settings(data=Path(folder), database_url=""))
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
"""Puts the data of each folder back, in processes that share their imports. The process of folder n is killed before its change n."""


def saved_clinic(folder: Path) -> Settings:
    """Return the settings of a clinic with a patient, whose data of before an update were saved."""
    upgraded_file(folder / "kata.db")
    made = Settings(data=folder, database_url="")
    with opened(made) as database:
        add_patient(database, "K-1")
        signed_in(database)
    (folder / "journal").mkdir()
    (folder / "journal" / "run-1.journal").write_bytes(b"measured")
    (folder / "spool").mkdir()
    (folder / "spool" / "1.spool").write_bytes(b"waiting")
    assert save(made)
    return made


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return saved_clinic(tmp_path)


@contextmanager
def opened(settings: Settings) -> Iterator[Database]:
    with closing(Database(settings.effective_database_url)) as database:
        yield database


def migrate(settings: Settings) -> None:
    """Change the schema and import what waits, as the start of a newer version does."""
    with closing(sqlite3.connect(settings.data / "kata.db")) as connection, connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("CREATE TABLE newer (id INTEGER)")
        connection.execute("UPDATE alembic_version SET version_num = 'newer'")
    (settings.journal / "run-1.journal").unlink()
    (settings.spool / "1.spool").unlink()


def schema(settings: Settings) -> str:
    with closing(sqlite3.connect(settings.data / "kata.db")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
        return str(connection.execute("SELECT version_num FROM alembic_version").fetchone()[0])


def test_a_changed_schema_is_replaced_with_what_waited(settings: Settings) -> None:
    before = schema(settings)
    migrate(settings)
    assert put_back(settings)
    assert schema(settings) == before
    assert (settings.journal / "run-1.journal").read_bytes() == b"measured"
    assert (settings.spool / "1.spool").read_bytes() == b"waiting"
    with opened(settings) as database, database.read() as session:
        assert session.scalars(select(LoginSessionRow.end_reason)).all() == ["restored"]
        assert session.scalars(select(AuditRow.action)).all()[-1] == "backup_restored"
    assert not put_back(settings), "the second time there is nothing to do"


def test_an_equal_schema_keeps_the_present_data(settings: Settings) -> None:
    with opened(settings) as database:
        add_patient(database, "K-2")
    assert not put_back(settings)
    with opened(settings) as database:
        assert clinic_numbers(database) == ["K-1", "K-2"]


def test_records_that_users_changed_since_are_never_discarded(settings: Settings) -> None:
    with opened(settings) as database:
        AuditHook(database)
        with database.write() as session:
            add_entry(session, entry("update_patient", patient_id=uuid4(), actor=SATO))
    migrate(settings)
    with pytest.raises(BackupError, match="Users have changed or seen records"):
        put_back(settings)
    assert schema(settings) == "newer"


def test_what_the_program_imports_is_put_back_and_imported_again(settings: Settings) -> None:
    with opened(settings) as database:
        AuditHook(database)
        with database.write() as session:
            add_entry(session, entry("import_run", patient_id=uuid4()))
    before = schema(settings)
    migrate(settings)
    assert put_back(settings)
    assert schema(settings) == before


def test_a_running_service_keeps_its_data(settings: Settings) -> None:
    with claimed_by_service(settings):
        for step in (save, put_back):
            with pytest.raises(BackupError, match="Kata is running"):
                step(settings)


def test_a_postgresql_database_is_not_touched(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path, database_url="postgresql+psycopg://kata@/kata?host=/nowhere")
    assert not save(settings)
    assert not put_back(settings)


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, list[Settings], list[int]]:
    """Return the schema before the update, the clinics whose put-back was killed, and the exit codes of the processes."""
    saved = saved_clinic(tmp_path_factory.mktemp("saved"))
    before = schema(saved)
    migrate(saved)
    top = tmp_path_factory.mktemp("killed")
    clinics = [Settings(data=shutil.copytree(saved.data, top / str(n)), database_url="") for n in _CHANGES]
    command = [sys.executable, "-c", _PUT_BACK_KILLED, *(str(clinic.data) for clinic in clinics)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return before, clinics, [int(code) for code in done.stdout.split()]


@pytest.mark.parametrize("change", _CHANGES)
def test_a_killed_put_back_leaves_one_whole_database(
    killed: tuple[str, list[Settings], list[int]], change: int
) -> None:
    before, clinics, codes = killed
    settings = clinics[change - 1]
    assert codes[change - 1] in (0, -signal.SIGKILL)
    assert codes[0] == -signal.SIGKILL
    assert schema(settings) in (before, "newer")
    put_back(settings)
    assert schema(settings) == before
    with opened(settings) as database:
        assert clinic_numbers(database) == ["K-1"]
