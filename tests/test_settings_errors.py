"""Every command reports each wrong setting in one sentence."""

import os
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from typer.main import get_command

from kata.__main__ import main
from kata.cli.main import app
from kata.settings import Settings
from tests.support.paths import ROOT

GIVEN: Final[dict[str, tuple[str, ...]]] = {
    "accounts link": (),
    "audit verify": (),
    "backup": (),
    "data-before-update": ("save",),
    "demo": ("--taught", "motion.csv"),
    "doctor": (),
    "openapi": (),
    "questionnaires add": ("motion.csv",),
    "questionnaires import": ("spadi", "motion.csv"),
    "restore": ("clinic.age",),
    "seed": (),
    "serve": ("--simulate",),
    "support-bundle": (),
}
OF_THEIR_OWN: Final = ("bench ", "commission", "evaluate", "identify", "messages", "mjcf", "update", "simulate")
"""Commands without settings, or with settings of their own."""
WRONG: Final = {
    "KATA_DATABASE_URL": (
        "nonsense",
        "must be the address of a database, such as postgresql+psycopg://kata@server/kata",
    ),
    "KATA_PORT": ("x", "must be a whole number"),
    "KATA_IDLE_MINUTES": ("0", "must be more than 0"),
    "KATA_LOGIN_SESSION_HOURS": ("long", "must be a number"),
    "KATA_PLAIN_HTTP": ("perhaps", "must be true or false"),
    "KATA_LOG_FORMAT": ("xml", "must be 'plain' or 'json'"),
    "KATA_BACKUP_TIME": ("noon", "must be a time of day such as 02:30, or never"),
    "KATA_TRUSTED_PROXIES": ("mine", "must be addresses or networks, separated by commas"),
    "KATA_OPENID_NAME": ("n" * 61, "must have 60 characters at most"),
}


def commands(command: Any, name: str = "") -> Iterator[str]:
    """Yield the full name of every command."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield name
    else:
        for command in inner:
            yield from commands(inner[command], f"{name} {command}".strip())


@pytest.fixture(autouse=True)
def own_umask() -> Iterator[None]:
    """Restore the umask, which the command sets for its whole process."""
    before = os.umask(0o022)
    yield
    os.umask(before)


def ended_with(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    monkeypatch.setattr(sys, "argv", ["kata", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code


@pytest.mark.parametrize(
    "command", [command for command in commands(get_command(app)) if not command.startswith(OF_THEIR_OWN)]
)
def test_every_command_names_the_setting_and_its_values(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in ("motion.csv", "clinic.age"):
        (tmp_path / file).touch()
    monkeypatch.setenv("KATA_PORT", "x")
    before = os.nice(0), signal.getsignal(signal.SIGTERM)
    assert ended_with(monkeypatch, *command.split(), *GIVEN[command]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "KATA_PORT must be a whole number.\n")
    assert (os.nice(0), signal.getsignal(signal.SIGTERM)) == before, "the command began before it checked the settings"


@pytest.mark.parametrize(("setting", "given", "takes"), [(name, *case) for name, case in WRONG.items()])
def test_each_setting_documents_its_values_and_reveals_none(
    setting: str, given: str, takes: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(setting, given)
    assert ended_with(monkeypatch, "backup") == 2
    assert capsys.readouterr().err == f"{setting} {takes}.\n"


def test_conflicting_and_multiple_wrong_settings_are_all_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("KATA_TLS_KEY", "key.pem")
    assert ended_with(monkeypatch, "backup") == 2
    assert capsys.readouterr().err.startswith("Certificate and key must be set together")
    monkeypatch.delenv("KATA_TLS_KEY")
    monkeypatch.setenv("KATA_DATABASE_POOLER_URL", "postgresql+psycopg://kata:secret@pooler/kata")
    assert ended_with(monkeypatch, "backup") == 2
    printed = capsys.readouterr().err
    assert printed.startswith("A pooler needs the address of PostgreSQL itself too")
    assert "secret" not in printed
    monkeypatch.setenv("KATA_PORT", "x")
    monkeypatch.setenv("KATA_DATABASE_URL", "secret-of-the-clinic")
    assert ended_with(monkeypatch, "doctor") == 2
    printed = capsys.readouterr().err
    assert printed.count("must be") == 2
    assert "secret" not in printed


def test_every_setting_named_by_program_pages_and_documents_exists() -> None:
    known = {f"KATA_{name.upper()}" for name in Settings.model_fields}
    files = [ROOT / "README.md"]
    for folder, kind in (("backend/kata", "*.py"), ("frontend/src", "*.ts*"), ("docs", "*.md")):
        files += (ROOT / folder).rglob(kind)
    named = {name: file.name for file in files for name in re.findall("KATA_[A-Z0-9_]+", file.read_text())}
    assert len(named) > 20
    assert {name: file for name, file in named.items() if name not in known} == {}
