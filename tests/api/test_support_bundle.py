"""``kata support-bundle`` describes an installation, also a broken one, and contains no secret."""

import json
import logging
import zipfile
from pathlib import Path

import pytest
from msgspec import structs

from kata.api.logs import JsonLines
from kata.cli import support_bundle
from kata.device import config
from kata.settings import Settings

_SECRET = "geheim7"
_PASSWORD = "passwort7"


def _parts(settings: Settings, out: Path) -> dict[str, str]:
    support_bundle.write(settings, out)
    with zipfile.ZipFile(out) as bundle:
        return {name: bundle.read(name).decode() for name in bundle.namelist()}


def test_names_addresses_and_secrets_of_the_settings_stay_out(tmp_path: Path) -> None:
    texts = {
        name: Path(f"/x/{_SECRET}") if "Path" in str(field.annotation) else _SECRET
        for name, field in Settings.model_fields.items()
        if ("str" in str(field.annotation) or "Path" in str(field.annotation))
        and name not in support_bundle.DISCLOSED_SETTINGS
    }
    url = f"postgresql+psycopg://kata:{_PASSWORD}@localhost:1/kata"
    settings = Settings(data=tmp_path).model_copy(update=texts | {"database_url": url})
    parts = _parts(settings, tmp_path / "bundle.zip")
    shown = json.loads(parts["settings.json"])
    assert shown.keys() == Settings.model_fields.keys()
    assert {name: shown[name] for name in texts} == dict.fromkeys(texts, "set")
    assert _SECRET not in parts["settings.json"]
    assert [name for name, text in parts.items() if _PASSWORD in text] == []


def test_unreadable_database_and_station_leave_the_other_parts_whole(tmp_path: Path) -> None:
    (tmp_path / "kata.db").write_bytes(b"no database" * 1000)
    settings = Settings(data=tmp_path, station=tmp_path / "missing.toml")
    parts = _parts(settings, tmp_path / "bundle.zip")
    broken = {name for name, text in parts.items() if "could not be made" in text}
    assert broken == {"station.toml", "database.json", "events.json"}
    assert json.loads(parts["versions.json"])["packages"]["kata"]
    assert any(check["state"] == "problem" for check in json.loads(parts["doctor.json"]))
    assert all(name in parts["README.txt"] for name in parts if name != "README.txt")


def test_log_of_the_unit_is_read_from_the_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "journalctl"
    program.write_text('#!/bin/sh\necho "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    parts = _parts(Settings(data=tmp_path), tmp_path / "bundle.zip")
    assert "--unit kata" in parts["log.txt"]


def test_collected_log_is_copied_without_the_audit_trail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With ``KATA_LOG_FORMAT=json`` the unit's log contains every row of it, with users and records."""
    record = logging.LogRecord("kata.station", logging.WARNING, "", 0, "the device process has ended", None, None)
    row = logging.LogRecord("kata.audit", logging.INFO, "", 0, "view", None, None)
    row.audit = {"who": "Sato Ken", "patient_id": "7"}
    lines = [JsonLines().format(record), JsonLines().format(row), "a line of systemd", "{no JSON", "[1]"]
    log = tmp_path / "log"
    log.write_text("".join(f"{line}\n" for line in lines))
    program = tmp_path / "journalctl"
    program.write_text(f"#!/bin/sh\ncat {log}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    parts = _parts(Settings(data=tmp_path), tmp_path / "bundle.zip")
    assert parts["log.txt"].splitlines() == [line for line in lines if "Sato" not in line]


def test_station_is_described_without_its_name(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    config.write(structs.replace(config.simulated("/dev/ttyKATA"), name="Room of Sato"), station)
    written = _parts(Settings(data=tmp_path, station=station), tmp_path / "bundle.zip")["station.toml"]
    assert "/dev/ttyKATA" in written
    assert "Sato" not in written
