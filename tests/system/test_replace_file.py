"""A file is replaced as a whole: whatever fails, and wherever the program is killed, it has the former or the new content."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.system.files import replace_file

FORMER, NEW = b"former content\n" * 40, b"new and shorter\n" * 30


class KilledError(BaseException):
    """The program is killed: none of its handlers for errors runs, as with SIGKILL."""


class FailingSystem:
    """Counts the calls to the system that replacing a file makes, and lets some of them fail."""

    def __init__(self, failing: dict[int, str], written: float) -> None:
        """``failing``: what happens at a call, "error" or "kill". ``written``: share of the data that a failing write has written."""
        self._failing = failing
        self._written = written
        self.calls: list[str] = []

    def __enter__(self) -> "FailingSystem":
        self._patches = [
            mock.patch("kata.system.files.os.fsync", self._wrap("fsync", os.fsync)),
            mock.patch("kata.system.files.os.fchmod", self._wrap("fchmod", os.fchmod)),
            mock.patch("kata.system.files.os.fchown", self._wrap("fchown", os.fchown)),
            mock.patch("kata.system.sync.os.open", self._wrap("open folder", os.open)),
            mock.patch.object(Path, "replace", self._wrap("rename", Path.replace)),
            mock.patch.object(Path, "unlink", self._wrap("unlink", Path.unlink)),
            mock.patch.object(Path, "open", self._open(Path.open)),
        ]
        for patch in self._patches:
            patch.start()
        return self

    def __exit__(self, *error: object) -> None:
        for patch in reversed(self._patches):
            patch.stop()

    def _fail_if_due(self, name: str) -> None:
        self.calls.append(name)
        how = self._failing.get(len(self.calls) - 1)
        if how == "error":
            raise OSError(28, "No space left on device")
        if how == "kill":
            raise KilledError

    def _wrap(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def failing(*arguments: Any, **options: Any) -> Any:
            self._fail_if_due(name)
            return call(*arguments, **options)

        return failing

    def _open(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def failing(path: Path, mode: str) -> Any:
            self._fail_if_due("open")
            return _FailingFile(call(path, mode, buffering=0), self._fail_if_due, self._written)

        return failing


class _FailingFile:
    """An unbuffered file whose writes can fail after a part."""

    def __init__(self, file: BinaryIO, fail_if_due: Callable[[str], None], written: float) -> None:
        self._file, self._fail_if_due, self._written = file, fail_if_due, written

    def __enter__(self) -> "_FailingFile":
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()

    def fileno(self) -> int:
        return self._file.fileno()

    def write(self, data: bytes) -> None:
        try:
            self._fail_if_due("write")
        except BaseException:
            self._file.write(data[: int(self._written * len(data))])
            raise
        self._file.write(data)

    def flush(self) -> None:
        self._fail_if_due("flush")


def test_each_call_to_the_system_can_be_made_to_fail(tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    file.write_bytes(FORMER)
    with FailingSystem({}, 0.0) as system:
        replace_file(file, NEW)
    assert file.read_bytes() == NEW
    assert system.calls == ["open", "fchmod", "fchown", "write", "flush", "fsync", "rename", "open folder", "fsync"]


@given(
    failing=st.dictionaries(st.integers(0, 10), st.sampled_from(["error", "kill"]), min_size=1, max_size=3),
    written=st.floats(0.0, 1.0),
    exists=st.booleans(),
)
def test_failed_or_killed_replacement_leaves_a_whole_file(
    failing: dict[int, str], written: float, exists: bool
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "station.toml"
        if exists:
            file.write_bytes(FORMER)
        completed = refused = False
        with FailingSystem(failing, written):
            try:
                replace_file(file, NEW)
                completed = True
            except OSError:
                refused = True
            except KilledError:
                pass
        former = FORMER if exists else None
        content = file.read_bytes() if file.exists() else None
        assert content in ((NEW,) if completed else (former,) if refused else (former, NEW))
        # What a killed program left behind hinders no later replacement.
        replace_file(file, NEW)
        assert file.read_bytes() == NEW
        assert [path.name for path in Path(folder).iterdir()] == [file.name]


def test_refused_replacement_names_the_error(tmp_path: Path) -> None:
    with FailingSystem({3: "error"}, 0.5), pytest.raises(OSError, match="No space left"):
        replace_file(tmp_path / "station.toml", NEW)
    assert list(tmp_path.iterdir()) == []
