"""``kata support-bundle`` describes an installation, also a broken one, and contains no secret."""

import json
import zipfile
from pathlib import Path

import pytest

from kata.cli import support_bundle
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
        if ("str" in str(field.annotation) or "Path" in str(field.annotation)) and name not in support_bundle.SHOWN
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
