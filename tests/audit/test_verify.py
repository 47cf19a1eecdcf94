"""The verification detects every kind of tampering with the trail and locates it."""

import json
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from sqlalchemy.orm import Session
from typer.testing import CliRunner

from kata.audit import anchor
from kata.audit.audit_log import format_head
from kata.audit.chain import Head
from kata.audit.verify import verify
from kata.cli.main import app
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.audit_tampering import cut, cut_anchor, filled, guards_down, judged, last_line, tricks
from tests.support.databases import upgraded_file
from tests.support.other_disk import other_disk

ROWS = 200
NAMES = [name for name, _ in tricks(ROWS, Random(0))]


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def audit_log(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Database, Path]]:
    """Return an intact trail. Every test leaves it unchanged."""
    folder = tmp_path_factory.mktemp("trail")
    on_file = request.param == "sqlite"
    database = Database(f"sqlite:///{folder / 'kata.db'}" if on_file else request.getfixturevalue("postgresql_url"))
    upgrade(database)
    filled(database, folder / "audit.anchor", ROWS)
    yield database, folder / "audit.anchor"
    if not on_file:
        with database.writer.begin() as connection:
            connection.exec_driver_sql("DROP SCHEMA public CASCADE")
            connection.exec_driver_sql("CREATE SCHEMA public")
    database.close()


def test_unchanged_trail_is_complete(audit_log: tuple[Database, Path]) -> None:
    database, file = audit_log
    with database.read() as session:
        verdict = verify(session, [file])
    assert verdict.findings == []
    assert (verdict.rows, verdict.lines, verdict.head) == (ROWS, ROWS // 20, last_line(file))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in (1, 2))])
def test_every_tampering_is_detected_and_located(audit_log: tuple[Database, Path], name: str, seed: int) -> None:
    database, file = audit_log
    trick = dict(tricks(ROWS, Random(f"{name} {seed}")))[name]
    played, verdict = judged(database, file, trick)
    assert verdict.findings, played
    if played.last:
        where = [(finding.first, finding.last) for finding in verdict.findings]
        assert any(first <= played.last and played.first <= last for first, last in where), (played, where)
    else:
        assert any("anchor" in finding.message for finding in verdict.findings), played


def test_truncation_is_reported_after_the_last_remaining_row(audit_log: tuple[Database, Path]) -> None:
    _, verdict = judged(*audit_log, lambda session, _: cut(session, ROWS, 30))
    assert [(finding.first, finding.last) for finding in verdict.findings] == [(171, 200)]
    assert verdict.findings[0].message == "Rows 171 to 200 are missing from the end: the anchor contains them."


def test_external_head_reveals_older_copies_of_database_and_anchor_together(
    audit_log: tuple[Database, Path],
) -> None:
    database, file = audit_log
    head, before = last_line(file), file.read_bytes()

    def older(session: Session) -> None:
        cut(session, ROWS, 40)
        cut_anchor(file, 2)

    try:
        with guards_down(database) as session:
            older(session)
            # Database and anchor agree: both are the older copies.
            assert verify(session, [file]).findings == []
            (finding,) = verify(session, [file], head).findings
    finally:
        file.write_bytes(before)
    assert (finding.first, finding.last) == (161, 200)


def test_anchor_copy_reveals_a_cut_of_database_and_anchor(audit_log: tuple[Database, Path], tmp_path: Path) -> None:
    database, file = audit_log
    before = file.read_bytes()
    copy = tmp_path / "copy.anchor"
    copy.write_bytes(before)
    try:
        with guards_down(database) as session:
            assert verify(session, [file], copies=[copy]).findings == []
            cut(session, ROWS, 40)
            cut_anchor(file, 2)
            assert verify(session, [file]).findings == []
            findings = verify(session, [file], copies=[copy]).findings
    finally:
        file.write_bytes(before)
    assert [(finding.first, finding.last) for finding in findings] == [(180, 200), (161, 200)]
    assert findings[0].message.startswith("The anchor lacks line 9 of its copy, and 2 lines in all, up to row 200")
    assert findings[1].message == "Rows 161 to 200 are missing from the end: the anchor's copy contains them."


def test_copy_that_lags_behind_is_a_remark(audit_log: tuple[Database, Path], tmp_path: Path) -> None:
    database, file = audit_log
    copy = tmp_path / "copy.anchor"
    copy.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:-3]))
    with database.read() as session:
        verdict = verify(session, [file], copies=[copy])
    assert verdict.findings == []
    assert verdict.remarks[-1].startswith(f"The copy {copy} ends 3 lines before the anchor.")


def test_only_the_last_anchor_line_can_be_missing_without_notice(
    audit_log: tuple[Database, Path],
) -> None:
    database, file = audit_log
    _, verdict = judged(database, file, lambda _, path: cut_anchor(path, 1))
    assert verdict.findings == []
    with guards_down(database) as session:
        cut(session, ROWS, 1)
        assert verify(session, [file]).findings != []


class TestCommand:
    @pytest.fixture
    def folder(self, tmp_path: Path) -> Path:
        database = Database(upgraded_file(tmp_path / "kata.db"))
        filled(database, tmp_path / "audit.anchor", 60)
        database.close()
        return tmp_path

    def run(self, folder: Path, *more: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, ["audit", "verify", "--data", str(folder), *more])
        return done.exit_code, done.output

    def test_verify_reports_a_complete_trail_and_what_to_store(self, folder: Path) -> None:
        status, output = self.run(folder)
        assert status == 0
        assert "No gap and no change was found: 60 rows, 3 anchors" in output
        assert "Not proven: that the audit trail is complete." in output
        head = format_head(last_line(folder / "audit.anchor"))
        assert head in output
        assert self.run(folder, "--head", head)[0] == 0
        assert self.run(folder, "--head", format_head(Head(61, bytes(32))))[0] == 1

    def test_verify_reports_the_damage_and_exits_with_status_1(self, folder: Path) -> None:
        database = Database(f"sqlite:///{folder / 'kata.db'}")
        with database.writer.begin() as connection:
            connection.exec_driver_sql("DROP TRIGGER audit_kept_as_it_is")
            connection.exec_driver_sql("UPDATE audit SET who = 'Nobody' WHERE number = 17")
        database.close()
        status, output = self.run(folder)
        assert status == 1
        assert "NOT INTACT  Row 17 or the row before it, 16, was changed." in output
        assert json.loads(self.run(folder, "--json")[1])["findings"][0]["first"] == 17

    def test_verify_compares_with_the_configured_copy(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        copy = folder / "elsewhere" / "copy.anchor"
        monkeypatch.setenv("KATA_AUDIT_ANCHOR_COPY", str(copy))
        status, output = self.run(folder)
        assert (status, f"copy {copy} cannot be read" in output) == (2, True)
        copy.parent.mkdir()
        copy.write_bytes((folder / "audit.anchor").read_bytes())
        status, output = self.run(folder)
        # A copy on the same disk proves nothing more.
        assert (status, "Not proven: that the audit trail is complete." in output) == (0, True)
        cut_anchor(folder / "audit.anchor", 1)
        status, output = self.run(folder)
        assert (status, "NOT INTACT  The anchor lacks line 3 of its copy" in output) == (1, True)
        assert "The audit trail is not intact: 60 rows" in output

    def test_verify_says_what_a_copy_on_another_disk_proves(self, folder: Path) -> None:
        with other_disk(folder) as disk:
            copy = disk / "copy.anchor"
            copy.write_bytes((folder / "audit.anchor").read_bytes())
            status, output = self.run(folder, "--anchor-copy", str(copy))
        assert (status, f"Compared with {copy}. Not proven: that this file was not changed" in output) == (0, True)

    def test_verify_exports_what_it_has_read(self, folder: Path) -> None:
        assert self.run(folder, "--export", str(folder / "trail.jsonl"))[0] == 0
        exported = [json.loads(line) for line in (folder / "trail.jsonl").read_text().splitlines()]
        assert [row["number"] for row in exported] == list(range(1, 61))
        assert exported[-1]["hash"] == last_line(folder / "audit.anchor").hash.hex()

    def test_several_services_anchors_are_looked_at_together(self, folder: Path) -> None:
        database = Database(f"sqlite:///{folder / 'kata.db'}")
        second = folder / "second.anchor"
        filled(database, second, 40)
        database.close()
        assert self.run(folder, "--anchor", str(folder / "audit.anchor"), "--anchor", str(second))[0] == 0
        status, output = self.run(folder)
        assert status == 1
        assert f"{anchor.read(second)[0].anchor} with 1 lines, which was not given" in output

    @pytest.mark.parametrize("more", [("--head", "ten"), ("--head", "1:ab")])
    def test_malformed_head_is_refused(self, folder: Path, more: tuple[str, ...]) -> None:
        assert self.run(folder, *more)[0] == 2

    def test_without_a_database_there_is_nothing_to_verify(self, tmp_path: Path) -> None:
        status, output = self.run(tmp_path)
        assert status == 2
        assert "cannot be read" in output
