"""Other users of the computer can read no file of the service."""

import logging
from pathlib import Path

import pytest

from kata.cli.serve import _make_private
from kata.system.private_files import make_private
from tests.support.file_modes import mode_of


@pytest.fixture
def open_folder(tmp_path: Path) -> Path:
    """Return a data folder as earlier versions made it."""
    folder = tmp_path / "data"
    for name, mode in (("kata.db", 0o644), ("journal/run.kata", 0o640), ("spool/1", 0o600)):
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("Yamada Hanako")
        file.chmod(mode)
    for path in (folder, folder / "journal", folder / "spool"):
        path.chmod(0o755)
    return folder


def test_folder_of_an_earlier_version_is_repaired_and_reported(
    open_folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        _make_private(open_folder)
        _make_private(open_folder)
    assert [f"{mode_of(path):o}" for path in (open_folder, open_folder / "journal", open_folder / "spool")] == [
        "700"
    ] * 3
    assert [f"{mode_of(path):o}" for path in sorted(open_folder.rglob("*")) if path.is_file()] == ["600"] * 3
    assert [record.getMessage() for record in caplog.records] == [
        f"other users of this computer could read 5 files and folders in {open_folder}; repaired"
    ]


def test_symbolic_link_is_not_followed(open_folder: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("not the clinic's")
    outside.chmod(0o644)
    (open_folder / "link").symlink_to(outside)
    make_private(open_folder)
    assert mode_of(outside) == 0o644


def test_file_of_another_user_is_reported(
    open_folder: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, mode: int) -> None:
        raise PermissionError(1, "Operation not permitted", str(path))

    monkeypatch.setattr(Path, "chmod", refused)
    _make_private(open_folder)
    assert caplog.messages == [f"other users of this computer may read {open_folder}: Operation not permitted"]


def test_missing_folder_is_no_problem(tmp_path: Path) -> None:
    assert make_private(tmp_path / "none") == []
