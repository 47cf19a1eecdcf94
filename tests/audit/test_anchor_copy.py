"""The copy of the audit trail's anchor on another disk or computer."""

import logging
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from kata.audit import anchor, entries
from kata.audit.anchor import Anchor, AnchorLine
from kata.audit.anchor_copy import AnchorCopy
from kata.audit.audit_log import AuditLog
from kata.audit.chain import Head
from kata.clinic.event_spool import EventSpool
from kata.database.engine import Database
from tests.support.audit_tampering import cut, cut_anchor, guards_down
from tests.support.databases import SQLITE_FIRST

LIMIT_S = 30.0


@contextmanager
def copying(file: Path, of: Path, ahead: list[AnchorLine] | None = None) -> Iterator[AnchorCopy]:
    known: list[AnchorLine] = [] if ahead is None else ahead
    copy = AnchorCopy(file, of, of.parent, known.append, retry_s=0.02)
    try:
        yield copy
    finally:
        copy.close()


def extend(file: Path, heads: int, copy: AnchorCopy | None = None) -> None:
    """Add lines to an anchor and to its copy."""
    opened = Anchor(file)
    for _ in range(heads):
        opened.add(Head(opened.lines + 1, bytes(32)))
        if copy and opened.last:
            copy.add(opened.last)
    opened.close()


def test_copy_gets_all_lines_also_former_ones(tmp_path: Path) -> None:
    file, second = tmp_path / "audit.anchor", tmp_path / "copy.anchor"
    extend(file, 3)
    with copying(second, file) as copy:
        assert copy.until_written(LIMIT_S)
        extend(file, 4, copy)
    extend(file, 2)
    with copying(second, file) as copy:
        extend(file, 2000, copy)
    assert second.read_bytes() == file.read_bytes()
    assert second.stat().st_mode & 0o777 == 0o600


def test_unwritable_copy_is_logged_once_and_retried(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "kata.audit")
    file, second = tmp_path / "audit.anchor", tmp_path / "share" / "copy.anchor"
    with copying(second, file) as copy:
        extend(file, 2, copy)
        assert not copy.until_written(0.2)
        assert copy.failing_since
        assert not second.parent.exists(), "the disk is not mounted"
        second.parent.mkdir()
        assert copy.until_written(LIMIT_S)
    assert second.read_bytes() == file.read_bytes()
    assert ["cannot be written" in record.message for record in caplog.records] == [True, False]
    assert "can be written again" in caplog.messages[-1]


def test_line_damaged_by_a_power_cut_spoils_no_other(tmp_path: Path) -> None:
    file, second = tmp_path / "audit.anchor", tmp_path / "copy.anchor"
    extend(file, 3)
    second.write_bytes(file.read_bytes()[:-20])
    with copying(second, file) as copy:
        assert copy.until_written(LIMIT_S)
    assert anchor.read(second) == anchor.read(file)


def test_copy_keeps_the_lines_that_the_anchor_has_lost(tmp_path: Path) -> None:
    file, second = tmp_path / "audit.anchor", tmp_path / "copy.anchor"
    extend(file, 5)
    second.write_bytes(file.read_bytes())
    last = anchor.read(file)[-1]
    cut_anchor(file, 2)
    ahead: list[AnchorLine] = []
    with copying(second, file, ahead) as copy:
        extend(file, 1, copy)
    assert ahead == [last]
    assert [line.line for line in anchor.read(second)] == [1, 2, 3, 4, 5, 4]


@pytest.fixture
def critical_messages(database: Database, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    """Return a function that starts the audit trail, writes an entry, and returns the critical log messages until now."""

    def run() -> list[str]:
        spool = EventSpool(database, "Station 1", tmp_path / "spool")
        made = AuditLog(database, tmp_path / "audit.anchor", spool, copy=tmp_path / "copy.anchor")
        assert made.copy and made.copy.until_written(LIMIT_S)
        made.record_at_once(entries.entry("stop"))
        assert made.until_written()
        made.close()
        spool.close()
        return [record.message for record in caplog.records if record.levelno == logging.CRITICAL]

    return run


@SQLITE_FIRST
def test_service_reports_a_cut_of_database_and_anchor(
    database: Database, tmp_path: Path, critical_messages: Callable[[], list[str]]
) -> None:
    file, second = tmp_path / "audit.anchor", tmp_path / "copy.anchor"
    assert critical_messages() == []
    assert len(anchor.read(second)) == len(anchor.read(file)) > 1
    rows = anchor.read(file)[-1].head.number
    with guards_down(database) as session:
        cut(session, rows, rows)
        session.commit()
    file.unlink()
    (message,) = critical_messages()
    assert f"the anchor has the head {rows}:" in message


@SQLITE_FIRST
def test_anchor_restored_from_its_copy_continues_the_trail(
    tmp_path: Path, critical_messages: Callable[[], list[str]]
) -> None:
    file, second = tmp_path / "audit.anchor", tmp_path / "copy.anchor"
    assert critical_messages() == []
    before = anchor.read(file)
    file.unlink()
    shutil.copy(second, file)
    assert critical_messages() == []
    after = anchor.read(file)
    assert after[: len(before)] == before
    assert len(after) > len(before)
    assert anchor.read(second) == after
