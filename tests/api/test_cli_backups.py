"""``kata backup``, ``kata restore`` and ``kata accounts link`` with valid and invalid arguments."""

import re
import subprocess
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from pyrage.x25519 import Identity
from sqlalchemy import select

from kata.auth import set_up
from kata.backups.create import create_backup
from kata.clinic.patients.tables import PatientRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import journal
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.kata_command import kata, kata_here


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Return the data folder of a clinic with one patient, K-1."""
    folder = tmp_path / "data"
    upgraded_file(folder / "kata.db")
    add_patient(folder, "K-1")
    return folder


def add_patient(data: Path, number: str) -> None:
    database, now = Database(f"sqlite:///{data / 'kata.db'}"), utc_now()
    with database.write() as session:
        session.add(
            PatientRow(
                id=uuid4(), clinic_number=number, name="N", sex="unknown", notes="", created_at=now, updated_at=now
            )
        )
    database.close()


def patients(data: Path) -> list[str]:
    database = Database(f"sqlite:///{data / 'kata.db'}")
    with database.read() as session:
        found = list(session.scalars(select(PatientRow.clinic_number).order_by(PatientRow.clinic_number)))
    database.close()
    return found


def backup_of(data: Path) -> Path:
    return Path(create_backup(Settings(data=data, database_url=""), "asked").file)


def refused(done: subprocess.CompletedProcess[str], sentence: str, code: int = 1) -> None:
    assert done.returncode == code, done.stdout + done.stderr
    assert sentence in " ".join(done.stderr.split()), done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_backup_command_prints_path_verification_and_what_to_store(data: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "not there yet" / "backups"
    done = kata("backup", "--data", data, "--to", elsewhere, folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (file,) = elsewhere.iterdir()
    assert f"Backup: {file} (" in done.stdout
    assert "Verified by a trial restore: complete, and equal to the database at the time of the backup." in done.stdout
    assert "The audit trail in the backup is intact: 0 rows." in done.stdout
    assert f"Key: {data / 'backup-key.txt'}. The backup cannot be opened without it" in done.stdout


def test_backup_without_a_trial_restore_reports_this(data: Path) -> None:
    backup_of(data)
    (data / "backup-key.txt").unlink()
    done = kata_here("backup", "--data", data)
    assert done.returncode == 0
    assert "Not verified: The key is not on this computer" in done.stdout
    assert "Key:" not in done.stdout


def test_backup_of_nothing_or_into_a_file_is_refused(data: Path, tmp_path: Path) -> None:
    refused(kata_here("backup", "--data", tmp_path / "empty"), "there is no database")
    (tmp_path / "a file").write_text("")
    refused(kata_here("backup", "--data", data, "--to", tmp_path / "a file"), "No backup was made: File exists")


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("KATA_BACKUP_RECIPIENTS", "ssh-rsa AAAA", "which is not a public key of age (age1...)"),
        ("KATA_BACKUP_KEY", "kata.db", "is not a backup key"),
    ],
)
def test_a_setting_that_makes_no_sense_makes_no_backup(
    data: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str, sentence: str
) -> None:
    monkeypatch.setenv(name, value)
    monkeypatch.chdir(data)
    refused(kata_here("backup", "--data", data), sentence)
    assert list(data.glob("backups/*")) == []


def test_trial_restore_changes_nothing_and_lists_the_contents(data: Path) -> None:
    file = backup_of(data)
    add_patient(data, "K-2")
    done = kata_here("restore", file, "--verify", "--data", data)
    assert (done.returncode, done.stderr) == (0, "")
    assert "equal to the database at that time. Nothing was changed." in done.stdout
    assert "The audit trail in the backup is intact: 0 rows." in done.stdout
    assert patients(data) == ["K-1", "K-2"]


def test_restore_over_an_existing_clinic_sets_it_aside(data: Path) -> None:
    file = backup_of(data)
    add_patient(data, "K-2")
    done = kata("restore", file, "--data", data, folder=data)
    assert (done.returncode, done.stderr) == (0, "")
    assert patients(data) == ["K-1"]
    aside = Path(re.findall(r"Previous data: (.*)", done.stdout)[0])
    assert patients(aside) == ["K-1", "K-2"]
    assert "All users must sign in again, with the passwords that they had at that time." in done.stdout


def test_a_restore_on_a_new_computer_takes_file_and_key(data: Path, tmp_path: Path) -> None:
    file = backup_of(data)
    refused(kata_here("restore", file, "--data", tmp_path / "new"), "give a copy of it with --key")
    done = kata_here("restore", file, "--key", data / "backup-key.txt", "--data", tmp_path / "new")
    assert (done.returncode, done.stderr) == (0, "")
    assert "Previous data: nothing" in done.stdout
    assert patients(tmp_path / "new") == ["K-1"]


@pytest.mark.parametrize("only_try", [[], ["--verify"]])
def test_invalid_or_locked_backup_changes_nothing(data: Path, tmp_path: Path, only_try: list[str]) -> None:
    file = backup_of(data)

    def restoring(backup: Path, *more: Any) -> subprocess.CompletedProcess[str]:
        return kata_here("restore", backup, *only_try, "--data", data, *more)

    refused(restoring(tmp_path / "nowhere"), "does not exist", code=2)
    refused(restoring(data), "is a directory", code=2)
    nonsense, cut_short, key = tmp_path / "nonsense", tmp_path / "cut-short", tmp_path / "key.txt"
    nonsense.write_text("something else")
    refused(restoring(nonsense), "is not a backup, or its beginning is damaged")
    cut_short.write_bytes(file.read_bytes()[:-100])
    refused(restoring(cut_short), "is not complete: it was truncated or changed")
    key.write_text(f"{Identity.generate()}\n")
    refused(restoring(file, "--key", key), "This key does not open")
    refused(restoring(file, "--key", tmp_path / "none.txt"), "cannot be read (No such file or directory)")
    key.write_text("# no key in here\n")
    refused(restoring(file, "--key", key), "contains no key")
    assert patients(data) == ["K-1"]
    assert list(data.glob("before-restore-*")) == []


def test_nothing_is_restored_under_a_service_at_work(data: Path) -> None:
    file = backup_of(data)
    with journal.claimed(data, 0.0):
        refused(kata_here("restore", file, "--data", data), f"Kata is running on {data}. Stop it")
        assert kata_here("restore", file, "--verify", "--data", data).returncode == 0


def test_only_the_latest_recovery_link_works_and_only_once(tmp_path: Path) -> None:
    data, made = tmp_path / "new" / "data", []
    for _ in range(2):
        done = kata("accounts", "link", "--data", data, "--url", "https://kata.clinic.example/", folder=tmp_path)
        assert done.returncode == 0
        made += re.findall(r"once, within 24 hours: https://kata.clinic.example/set-up#secret=(\S+)", done.stderr)
        assert done.stdout == "", "the output contains no secret"
    first, last = made
    assert not set_up.is_valid(data, first, utc_now())
    assert set_up.is_valid(data, last, utc_now())
    assert all(last not in file.read_text() for file in data.iterdir())
    assert (data / "set-up-link.json").stat().st_mode & 0o777 == 0o600


def test_a_link_needs_a_folder_that_can_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "a file").write_text("")
    refused(
        kata_here("accounts", "link", "--data", tmp_path / "a file"),
        f"Cannot write to {tmp_path / 'a file'}",
    )
