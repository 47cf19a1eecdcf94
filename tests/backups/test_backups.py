"""Backups on both kinds of database: their contents, their keys, and restoring a clinic from them."""

import gzip
import io
import logging
import os
import tarfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event, Thread
from typing import Any
from uuid import uuid4

import msgspec
import pyrage
import pytest
from pyrage.x25519 import Identity
from sqlalchemy import select

from kata.audit.audit_log import AuditLog
from kata.audit.tables import AuditRow
from kata.audit.verify import Verdict, verify
from kata.auth import access_tokens
from kata.auth.factor_key import read_factor_key
from kata.auth.second_factor import count_undecryptable
from kata.auth.tables import AccountRow, LoginSessionRow
from kata.backups import archive, catalogue, create, restore
from kata.backups.catalogue import import_records
from kata.backups.create import create_backup, expired_backups
from kata.backups.folder import UnfinishedRestoreError, claimed_by_service, one_at_a_time
from kata.backups.key import BackupError, identities, key_location, make_key
from kata.backups.restore import restore_backup, verify_and_record
from kata.backups.tables import BackupRow
from kata.clinic.event_spool import EventSpool
from kata.clinic.patients.tables import PatientRow
from kata.database.base import utc_now
from kata.database.database_copy import copy
from kata.database.engine import Database
from kata.database.table_checksums import TableChecksum, checksums
from kata.settings import Settings
from tests.support.databases import SQLITE_FIRST, upgraded_file
from tests.support.login import signed_in
from tests.support.patients import SECRET_NAME, add_patient, clinic_numbers

log = logging.getLogger(__name__)


@pytest.fixture
def settings(database: Database, tmp_path: Path) -> Settings:
    """Return the settings of a clinic with a patient, a signed-in administrator, a journal that is not imported yet, and an anchor."""
    add_patient(database, "K-1")
    signed_in(database)
    (tmp_path / "journal" / "imported").mkdir(parents=True)
    (tmp_path / "journal" / "run-1.journal").write_bytes(b"measured")
    (tmp_path / "journal" / "imported" / "run-0.journal").write_bytes(b"in the database already")
    (tmp_path / "station-in-use.toml").write_text('side = "left"')
    url = "" if database.file else database.url.render_as_string(hide_password=False)
    return Settings(data=tmp_path, database_url=url)


@pytest.fixture
def small(tmp_path: Path) -> Settings:
    """Return the settings of an empty clinic on SQLite, for tests that need no data."""
    upgraded_file(tmp_path / "kata.db")
    return Settings(data=tmp_path, database_url="")


def counted(settings: Settings) -> dict[str, TableChecksum]:
    database = Database(settings.effective_database_url)
    try:
        with database.reader.connect() as connection:
            return checksums(connection)
    finally:
        database.close()


def backup_of(settings: Settings) -> Path:
    return Path(create_backup(settings, "asked").file)


# -- a backup, and the way back ---------------------------------------------------------------------------------------


def test_backup_restores_the_database_unchanged(settings: Settings, database: Database) -> None:
    before = counted(settings)
    note = create_backup(settings, "asked")
    assert (note.problem, note.test_problem) == ("", "")
    assert note.tested_at is not None
    add_patient(database, "K-2")
    (settings.journal / "run-1.journal").unlink()
    (settings.journal / "run-2.journal").write_bytes(b"of after the backup")
    database.close()

    restored = restore_backup(settings, Path(note.file), settings.backup_key_file)

    assert clinic_numbers(database) == ["K-1"]
    assert restored.contents.tables == before
    changed = {name for name, checksum in counted(settings).items() if checksum != before[name]}
    assert changed <= {"sign_ins", "accounts", "audit"}
    assert (settings.journal / "run-1.journal").read_bytes() == b"measured"
    assert not (settings.journal / "run-2.journal").exists()
    (aside,) = settings.data.glob("before-restore-*")
    assert (aside / "journal" / "run-2.journal").read_bytes() == b"of after the backup"
    assert not (settings.data / "restoring").exists()
    assert list(settings.data.glob(".backup-*")) == []


@SQLITE_FIRST
def test_restore_sets_the_replaced_data_aside_completely(settings: Settings, database: Database) -> None:
    file = backup_of(settings)
    add_patient(database, "K-2")
    database.close()
    restored = restore_backup(settings, file, settings.backup_key_file)
    if database.file:
        (aside,) = settings.data.glob("before-restore-*")
        assert clinic_numbers(Database(f"sqlite:///{aside / 'kata.db'}")) == ["K-1", "K-2"]
        assert str(aside) in restored.aside
        return
    schema = restored.aside.split()[-4]
    with database.reader.connect() as connection:
        assert connection.exec_driver_sql(f'SELECT count(*) FROM "{schema}".patients').scalar() == 2
    # The folder is no part of the next backup, and the next restore makes another one.
    assert create_backup(settings, "asked").test_problem == ""
    with database.writer.begin() as connection:
        connection.exec_driver_sql(f'DROP SCHEMA "{schema}" CASCADE')


def test_on_a_new_computer_file_and_key_are_enough(settings: Settings, database: Database, tmp_path: Path) -> None:
    if not database.file:
        pytest.skip("a server's database is not in the folder")
    file = backup_of(settings)
    key = tmp_path / "printed.txt"
    key.write_text(settings.backup_key_file.read_text())
    new = Settings(data=tmp_path / "new", database_url="")
    restored = restore_backup(new, file, key)
    assert "nothing" in restored.aside
    assert clinic_numbers(Database(new.effective_database_url)) == ["K-1"]
    assert (new.journal / "run-1.journal").read_bytes() == b"measured"
    assert not (new.journal / "imported").exists()
    assert (new.data / "station-in-use.toml").read_text() == 'side = "left"'
    # The same key opens the new computer's backups.
    assert str(identities(new.backup_key_file)[0]) == str(identities(key)[0])
    assert create_backup(new, "asked").test_problem == ""


@SQLITE_FIRST
def test_restore_revokes_everything_that_was_open_at_the_backup(settings: Settings, database: Database) -> None:
    with database.write() as session:
        account = session.scalars(select(AccountRow)).one()
        account.code_hash = "0" * 64
        access_tokens.create(session, account.id, "Nightly export", timedelta(days=30), utc_now())
    file = backup_of(settings)
    database.close()
    restore_backup(settings, file, settings.backup_key_file)
    with database.read() as session:
        assert session.scalars(select(LoginSessionRow)).one().end_reason == "restored"
        assert session.scalars(select(AccountRow)).one().code_hash is None
        assert access_tokens.list_valid(session, utc_now()) == []


@SQLITE_FIRST
def test_audit_trail_continues_after_a_restore_and_records_the_loss(
    settings: Settings, database: Database, tmp_path: Path
) -> None:
    with trail_of(settings, database):
        file = backup_of(settings)
        add_patient(database, "K-2")
    database.close()
    elsewhere = settings
    if database.file:
        # The anchor is lost with the computer, so the backup's anchor is used.
        elsewhere = Settings(data=tmp_path / "new", database_url="")
        restore_backup(elsewhere, file, settings.backup_key_file)
        assert verdict(elsewhere).remarks[0].startswith("Row ")
        assert verdict(elsewhere).findings == []
    restore_backup(settings, file, settings.backup_key_file)
    found = verdict(settings)
    assert found.findings == []
    assert "a backup was restored, which discarded the rows since that backup" in found.remarks[0]
    with trail_of(settings, database):
        pass
    assert verdict(settings).findings == []


@contextmanager
def trail_of(settings: Settings, database: Database) -> Iterator[AuditLog]:
    """Return the audit log of a service."""
    with (
        closing(EventSpool(database, "Station 1", settings.spool)) as spool,
        closing(AuditLog(database, settings.effective_audit_anchor, spool)) as audit_log,
    ):
        assert audit_log.until_written()
        yield audit_log


@SQLITE_FIRST
def test_a_backup_brings_the_key_of_the_second_factors_along(
    settings: Settings, database: Database, tmp_path: Path
) -> None:
    of_then = read_factor_key(settings.effective_second_factor_key)
    with database.write() as session:
        account = session.scalars(select(AccountRow)).one()
        account.totp_sealed = of_then.encrypt("a secret", account.id)
    file = backup_of(settings)
    # Given: another key on this computer, and another computer without a key.
    settings.effective_second_factor_key.unlink()
    since = read_factor_key(settings.effective_second_factor_key).encrypt("a secret", account.id)
    database.close()
    restore_backup(settings, file, settings.backup_key_file)
    key = read_factor_key(settings.effective_second_factor_key)
    with database.read() as session:
        assert count_undecryptable(session, key) == 0
    assert key.decrypt(since, account.id) == "a secret"
    if database.file:
        new = Settings(data=tmp_path / "new", database_url="", second_factor_key=tmp_path / "elsewhere" / "key.txt")
        restore_backup(new, file, settings.backup_key_file)
        with Database(new.effective_database_url).read() as session:
            assert count_undecryptable(session, read_factor_key(new.effective_second_factor_key)) == 0
        assert not (new.data / "second-factor-key.txt").exists()


@SQLITE_FIRST
def test_trial_restore_verifies_the_audit_trail(settings: Settings, database: Database) -> None:
    with trail_of(settings, database):
        add_patient(database, "K-2")
    with database.read() as session:
        rows = len(session.scalars(select(AuditRow.number)).all())
    whole = create_backup(settings, "asked")
    assert (whole.test_problem, whole.audit_rows, whole.audit_problem) == ("", rows, "")
    assert rows > 2

    # Given: an attacker removes the triggers and the last row.
    with database.writer.begin() as connection:
        on = "" if database.file else " ON audit"
        connection.exec_driver_sql(f"DROP TRIGGER audit_kept{on}")
        connection.exec_driver_sql(f"DELETE FROM audit WHERE number = {rows}")
    cut_off = create_backup(settings, "asked")
    assert cut_off.test_problem == "", "it can be restored all the same"
    assert cut_off.audit_rows == rows - 1
    assert f"Row {rows} is missing from the end: the anchor contains it." in cut_off.audit_problem
    import_records(settings, database)
    with database.read() as session:
        assert sorted(row.audit_problem != "" for row in session.scalars(select(BackupRow))) == [False, True]
    tried = verify_and_record(settings, Path(cut_off.file), settings.backup_key_file)
    assert (tried.problems, tried.audit_problem) == ([], cut_off.audit_problem)


@SQLITE_FIRST
def test_writes_during_a_backup_do_not_damage_its_trail(
    settings: Settings, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The backup copies the anchor after the database, so the anchor contains later rows."""
    with trail_of(settings, database) as audit_log:

        def with_somebody_at_work(*given: Any) -> Any:
            answer = copy(*given)
            add_patient(database, "K-2")
            assert audit_log.until_written()
            return answer

        monkeypatch.setattr(create, "copy", with_somebody_at_work)
        note = create_backup(settings, "asked")
    assert (note.test_problem, note.audit_problem) == ("", "")
    assert note.audit_rows


@SQLITE_FIRST
def test_shared_trail_verifies_without_the_other_services_anchors(
    settings: Settings, database: Database, tmp_path: Path
) -> None:
    for name in ("other", "audit"):
        of_it = settings.model_copy(update={"audit_anchor": tmp_path / f"{name}.anchor"})
        with trail_of(of_it, database):
            add_patient(database, f"K-{name}")
    note = create_backup(settings, "asked")
    assert (note.test_problem, note.audit_problem) == ("", "")


def verdict(settings: Settings) -> Verdict:
    database = Database(settings.effective_database_url)
    with database.read() as session:
        answer = verify(session, [settings.effective_audit_anchor])
    database.close()
    return answer


@SQLITE_FIRST
def test_each_of_several_backups_under_load_is_consistent(settings: Settings, database: Database) -> None:
    """The clients write consecutive numbers, two in a transaction. A backup contains an even count without gaps."""
    assert_of_one_moment(settings, database, backups=3)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_each_of_a_hundred_backups_under_load_is_consistent(settings: Settings, database: Database) -> None:
    assert_of_one_moment(settings, database, backups=100)


def assert_of_one_moment(settings: Settings, database: Database, backups: int) -> None:
    """Make ``backups`` backups while a client writes; restore and check each."""
    done, wrote = Event(), Event()
    acknowledged = [0]

    def write() -> None:
        # Without a pause, most of the time would be spent on rows of the first backups.
        while not done.wait(0.01):
            now, first = utc_now(), acknowledged[0]
            with database.write() as session:
                session.add_all(
                    PatientRow(
                        id=uuid4(), clinic_number=f"N-{first + n:09d}", name="N", sex="unknown", notes="x" * 500,
                        created_at=now, updated_at=now,
                    )
                    for n in range(2)
                )  # fmt: skip
            acknowledged[0] += 2
            wrote.set()

    writer = Thread(target=write)
    writer.start()
    try:
        for _ in range(backups):
            wrote.clear()
            assert wrote.wait(10)
            least = acknowledged[0]
            note = create_backup(settings, "asked")
            most = acknowledged[0] + 2
            assert (note.problem, note.test_problem) == ("", ""), note
            held = numbers_in(settings, Path(note.file))
            assert held == [f"N-{n:09d}" for n in range(len(held))]
            assert len(held) % 2 == 0
            assert least <= len(held) <= most
            Path(note.file).unlink()
            log.info("a backup of %d rows, of one moment while %d to %d were acknowledged", len(held), least, most)
    finally:
        done.set()
        writer.join()


def numbers_in(settings: Settings, file: Path) -> list[str]:
    """Return the clinic numbers in a backup, read without Kata's own comparison."""
    database = Database(settings.effective_database_url)
    held: list[str] = []
    original = restore._find_problems

    def looked_at(made: Database, contents: archive.Contents) -> list[str]:
        held.extend(number for number in clinic_numbers(made) if number.startswith("N-"))
        return original(made, contents)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(restore, "_find_problems", looked_at)
        assert restore.verify_backup(settings, database, file, identities(settings.backup_key_file)).problems == []
    database.close()
    return held


# -- refused backups and restores -----------------------------------------------------------------------------------------


@SQLITE_FIRST
def test_backup_file_reveals_nothing_without_its_key(settings: Settings) -> None:
    file = backup_of(settings)
    assert SECRET_NAME.encode() not in file.read_bytes()
    assert file.stat().st_mode & 0o777 == 0o600
    assert settings.backup_key_file.stat().st_mode & 0o777 == 0o600
    other = settings.data / "other-key.txt"
    other.write_text(f"{Identity.generate()}\n")
    with pytest.raises(BackupError, match=r"this key does not open .* made with another key"):
        restore_backup(settings, file, other)
    with pytest.raises(BackupError, match="give a copy of it with --key"):
        restore_backup(settings, file, settings.data / "nowhere.txt")
    other.write_text("AGE-SECRET-KEY-1MISTYPED\n")
    with pytest.raises(BackupError, match="must be a complete key"):
        restore_backup(settings, file, other)


def test_truncated_or_changed_backup_is_refused_and_changes_nothing(small: Settings) -> None:
    (small.data / "some.toml").write_bytes(os.urandom(200_000))
    file = backup_of(small)
    whole, before = file.read_bytes(), counted(small)
    places = [0, 10, 60, 150, 200, 300, 65_000, 65_800, 131_500, len(whole) // 2, len(whole) - 17, len(whole) - 1]
    for place in places:
        file.write_bytes(whole[:place])
        with pytest.raises(BackupError, match=r"not complete|is not a backup, or its beginning is damaged"):
            restore_backup(small, file, small.backup_key_file)
        changed = bytearray(whole)
        changed[place] ^= 1
        file.write_bytes(bytes(changed))
        with pytest.raises(BackupError, match=r"not complete|its beginning is damaged"):
            restore_backup(small, file, small.backup_key_file)
    assert counted(small) == before
    assert list(small.data.glob("before-restore-*")) == []
    with claimed_by_service(small):
        pass


def forged(small: Settings, contents: dict[str, object], *members: tuple[tarfile.TarInfo, bytes]) -> Path:
    """Return a file that opens with the clinic's key. The public key is enough to make it."""
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as zipped, tarfile.open(fileobj=zipped, mode="w|") as tar:
        head, answer = tarfile.TarInfo("kata-backup.json"), msgspec.json.encode(contents)
        for info, data in ((head, answer), *members):
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    file = small.data / "forged.kata-backup"
    file.write_bytes(pyrage.encrypt(packed.getvalue(), [identities(small.backup_key_file)[0].to_public()]))
    return file


def answer(small: Settings) -> dict[str, object]:
    contents: dict[str, object] = msgspec.to_builtins(
        verify_and_record(small, backup_of(small), small.backup_key_file).contents
    )
    return contents


def test_backup_of_newer_version_or_other_database_explains_the_remedy(small: Settings) -> None:
    honest = answer(small)
    for change, sentence in (
        ({"schema": "9999", "program": "7.0"}, "newer version of Kata .7.0, schema 9999.*Install the newer version"),
        ({"format": "kata-backup/2"}, "newer version of Kata .its format is 'kata-backup/2'.; install that version"),
        ({"database": "postgresql"}, "a backup of a PostgreSQL database, but this computer uses SQLite: set KATA_DATABASE_URL to an empty PostgreSQL database"),
        ({"bytes": 10**18}, "unpacking needs .* MB on the disk of"),
        ({"tables": "none"}, "Kata cannot read the description"),
    ):  # fmt: skip
        with pytest.raises(BackupError, match=sentence):
            restore_backup(small, forged(small, honest | change), small.backup_key_file)


@pytest.mark.parametrize(
    "name",
    [
        "../outside",
        *(pytest.param(name, marks=pytest.mark.campaign) for name in ("/tmp/outside", "data/../../outside")),
    ],
)
def test_nothing_in_a_file_is_written_outside(small: Settings, name: str) -> None:
    with pytest.raises(BackupError, match="not a backup of Kata"):
        restore_backup(small, forged(small, answer(small), (tarfile.TarInfo(name), b"x")), small.backup_key_file)
    link = tarfile.TarInfo("data/link")
    link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
    with pytest.raises(BackupError, match="not a backup of Kata"):
        restore_backup(small, forged(small, answer(small), (link, b"")), small.backup_key_file)


def test_restored_copy_with_different_counts_is_not_put_in_place(small: Settings) -> None:
    file, before = backup_of(small), counted(small)
    keys = identities(small.backup_key_file)
    work = small.data / "looked-at"
    contents = archive.read_archive(file, keys, work, lambda _: None)
    added = Database(f"sqlite:///{work / 'database'}")
    add_patient(added, "K-9")
    added.close()
    file.unlink()
    archive.write_archive(file, [keys[0].to_public()], contents, work)
    with pytest.raises(BackupError, match="patients has 1 rows instead of 0"):
        restore_backup(small, file, small.backup_key_file)
    assert counted(small) == before
    assert "patients has 1 rows instead of 0" in verify_and_record(small, file, small.backup_key_file).problems


def test_nothing_is_replaced_under_a_running_service(settings: Settings, database: Database) -> None:
    file = backup_of(settings)
    add_patient(database, "K-2")
    with claimed_by_service(settings):
        with pytest.raises(BackupError, match=r"Kata is running on .* Stop it"):
            restore_backup(settings, file, settings.backup_key_file)
        assert verify_and_record(settings, file, settings.backup_key_file).problems == []
    assert clinic_numbers(database) == ["K-1", "K-2"]


def test_server_with_other_connections_is_not_replaced(settings: Settings, database: Database) -> None:
    if database.file:
        pytest.skip("a file has no others that are connected")
    file = backup_of(settings)
    with (
        database.reader.connect(),
        pytest.raises(Exception, match=r"other clients are connected to .* stop every Kata that uses it"),
    ):
        restore_backup(settings, file, settings.backup_key_file)
    assert clinic_numbers(database) == ["K-1"]


@pytest.mark.campaign
def test_restore_waits_for_a_client_that_is_disconnecting(
    settings: Settings, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server still lists a client for a moment after it has disconnected."""
    if database.file:
        pytest.skip("a file has no others that are connected")
    file = backup_of(settings)
    add_patient(database, "K-2")
    database.close()
    leaving = Database(database.url.render_as_string(hide_password=False))
    client = leaving.reader.connect()
    waited = Event()

    def leave(_: float) -> None:
        client.close()
        leaving.close()
        waited.set()

    monkeypatch.setattr("kata.database.database_copy.sleep", leave)
    restore_backup(settings, file, settings.backup_key_file)
    assert waited.is_set()
    assert clinic_numbers(database) == ["K-1"]


@SQLITE_FIRST
def test_restore_that_fails_halfway_leaves_everything_unchanged(
    settings: Settings, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = backup_of(settings)
    add_patient(database, "K-2")
    database.close()

    def fails(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(restore, "revoke_access", fails)
    with pytest.raises(OSError, match="No space left"):
        restore_backup(settings, file, settings.backup_key_file)
    assert clinic_numbers(database) == ["K-1", "K-2"]
    with claimed_by_service(settings):
        assert (settings.journal / "run-1.journal").exists()


@SQLITE_FIRST
def test_interrupted_restore_is_reported_at_start_and_can_be_repeated(
    settings: Settings, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = backup_of(settings)
    database.close()

    def cut_off(*arguments: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(restore, "_replace_files", cut_off)
        with pytest.raises(KeyboardInterrupt):
            restore_backup(settings, file, settings.backup_key_file)
    with pytest.raises(UnfinishedRestoreError, match="Run it again: kata restore"), claimed_by_service(settings):
        pass
    restore_backup(settings, file, settings.backup_key_file)
    with claimed_by_service(settings):
        assert clinic_numbers(database) == ["K-1"]
        assert (settings.journal / "run-1.journal").read_bytes() == b"measured"


# -- the key ----------------------------------------------------------------------------------------------------------


def test_key_is_made_once_and_may_be_moved_elsewhere(small: Settings) -> None:
    assert key_location(small) == "nowhere"
    assert make_key(small)
    key = small.backup_key_file.read_text()
    assert not make_key(small)
    assert small.backup_key_file.read_text() == key
    assert "Store a copy of this file outside this computer" in key
    away = small.data / "in-the-safe.txt"
    small.backup_key_file.rename(away)
    note = create_backup(small, "asked")
    assert key_location(small) == "elsewhere"
    assert not make_key(small)
    assert (note.problem, note.tested_at) == ("", None)
    assert "The key is not on this computer" in note.test_problem
    # With the key, a backup that was made without it can be verified, and its record says so.
    assert verify_and_record(small, Path(note.file), away).problems == []
    database = Database(small.effective_database_url)
    import_records(small, database)
    with database.read() as session:
        row = session.scalars(select(BackupRow)).one()
        assert (row.test_problem, row.tested_at is not None) == ("", True)
    database.close()


def test_additional_recipients_in_the_settings_can_open_backups(small: Settings) -> None:
    director = Identity.generate()
    of_two = small.model_copy(update={"backup_recipients": f"{director.to_public()}"})
    file = backup_of(of_two)
    key = small.data / "director.txt"
    key.write_text(f"{director}\n")
    assert verify_and_record(small, file, key).problems == []
    wrong = small.model_copy(update={"backup_recipients": "age1mistyped"})
    with pytest.raises(BackupError, match="KATA_BACKUP_RECIPIENTS contains 'age1mistyped'"):
        create_backup(wrong, "asked")


# -- what becomes of them ---------------------------------------------------------------------------------------------


def test_old_backups_are_deleted_except_a_fortnight_and_monthly_firsts(tmp_path: Path) -> None:
    now = datetime(2026, 11, 22, 3, tzinfo=UTC)
    for day in range(500):
        at = now - timedelta(days=day)
        (tmp_path / f"kata-{at:%Y%m%dT%H%M%SZ}-{day:08x}.kata-backup").touch()
    (tmp_path / "somebody-elses.kata-backup").touch()
    for file in expired_backups(tmp_path, now):
        file.unlink()
    kept = sorted(file.name[5:13] for file in tmp_path.iterdir() if file.name.startswith("kata-"))
    months = [
        "20251201",
        "20260101",
        "20260201",
        "20260301",
        "20260401",
        "20260501",
        "20260601",
        "20260701",
        "20260801",
    ]
    months += ["20260901", "20261001", "20261101"]
    assert kept == months + [f"202611{day:02d}" for day in range(8, 23)]
    assert (tmp_path / "somebody-elses.kata-backup").exists()


def test_failed_backup_is_recorded_with_its_reason(small: Settings) -> None:
    in_the_way = small.data / "file"
    in_the_way.touch()
    nowhere = small.model_copy(update={"backup_dir": in_the_way / "backups"})
    with pytest.raises(BackupError, match="No backup was made: Not a directory"):
        create_backup(nowhere, "nightly")
    database = Database(small.effective_database_url)
    import_records(small, database)
    import_records(small, database)
    with database.read() as session:
        (row,), _ = catalogue.newest(session, limit=10)
        assert row.problem.startswith("Not a directory")
        assert catalogue.last_made(session) is None
    database.close()


def test_only_one_backup_is_made_at_a_time(small: Settings) -> None:
    with one_at_a_time(small), pytest.raises(BackupError, match="another backup is being made"):
        create_backup(small, "asked")


def test_next_backup_deletes_unencrypted_leftovers_of_a_killed_one(small: Settings) -> None:
    left = small.data / ".backup-killed"
    left.mkdir()
    (left / "database").write_text("not encrypted")
    create_backup(small, "asked")
    assert not left.exists()
