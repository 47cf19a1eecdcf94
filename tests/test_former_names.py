"""Former names of settings and options are accepted for one release, with a warning."""

import logging
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kata import settings as module
from kata.cli.main import app
from kata.settings import FORMER_NAMES, Settings

VALUES = {
    "backups": "/backups",
    "backup_at": "03:15",
    "clinic_zone": "Asia/Tokyo",
    "metrics_token": "/token",
    "sign_in_hours": "8",
}


@pytest.fixture(autouse=True)
def unwarned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_warned", set())


@pytest.mark.parametrize("former", FORMER_NAMES)
def test_former_setting_is_used_with_a_single_warning(
    former: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    name = FORMER_NAMES[former]
    monkeypatch.setenv(f"KATA_{former.upper()}", VALUES[former])
    with caplog.at_level(logging.WARNING):
        read = [getattr(Settings(), name) for _ in range(2)]
    monkeypatch.delenv(f"KATA_{former.upper()}")
    monkeypatch.setenv(f"KATA_{name.upper()}", VALUES[former])
    assert read == [getattr(Settings(), name)] * 2 != [Settings.model_fields[name].default] * 2
    (warning,) = caplog.messages
    assert warning.startswith(f"KATA_{former.upper()} is now called KATA_{name.upper()}")


def test_current_name_and_options_override_a_former_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KATA_BACKUPS", "/former")
    monkeypatch.setenv("KATA_BACKUP_DIR", "/current")
    assert Settings().backup_dir == Path("/current")
    assert Settings(backup_dir=Path("/option")).backup_dir == Path("/option")


def test_empty_former_name_counts_as_unset(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setenv("KATA_BACKUPS", "")
    assert Settings().backup_dir is None
    assert caplog.messages == []


def test_restore_accepts_try_with_a_warning(tmp_path: Path) -> None:
    (tmp_path / "clinic.age").write_text("no backup")
    former, current = (
        CliRunner().invoke(app, ["restore", str(tmp_path / "clinic.age"), option, "--data", str(tmp_path)])
        for option in ("--try", "--verify")
    )
    assert former.exit_code == current.exit_code == 1
    warning = "--try is now called --verify; the next release does not accept --try.\n"
    assert former.stderr == warning + current.stderr


def test_bench_accepts_sign_in_as_a_hidden_command() -> None:
    runner = CliRunner()
    assert "password-guessing" in runner.invoke(app, ["bench", "--help"]).output
    assert "sign-in" not in runner.invoke(app, ["bench", "--help"]).output
    assert runner.invoke(app, ["bench", "sign-in", "--help"]).exit_code == 0
