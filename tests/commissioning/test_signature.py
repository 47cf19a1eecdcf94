"""A commissioning record is signed with the station's key. A changed record is named, wherever it is stored."""

import os
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest
from msgspec import structs

from kata.bench.commissioned import write_commissioned
from kata.cli import commission as cli
from kata.commissioning import texts
from kata.commissioning.record import (
    CHECKED,
    CommissioningRecord,
    RecordedStep,
    RecordError,
    check_parts,
    commissioning_part,
    key_path,
    read_record,
    record_path,
    sealed,
    signature_state,
    write_record,
)
from kata.commissioning.status import commissioning_status
from kata.device.config import simulated
from kata.reporting.letterhead import Letterhead
from kata.reporting.rendering import PrintOptions, commissioning_page
from tests.support.file_modes import mode_of

AT = datetime(2026, 3, 2, 10, 0, tzinfo=UTC)
CONFIG = simulated("virtual")


@pytest.fixture
def station(tmp_path: Path) -> Path:
    path = tmp_path / "station.toml"
    write_commissioned(CONFIG, path, AT)
    return path


def present(station: Path) -> CommissioningRecord:
    record = read_record(record_path(station))
    assert record is not None
    return record


def store(record: CommissioningRecord, station: Path) -> None:
    """Write a record without the station's key."""
    record_path(station).write_bytes(msgspec.json.encode(record))


def with_check(record: CommissioningRecord) -> CommissioningRecord:
    steps = tuple(RecordedStep(key, AT.isoformat(), AT.isoformat(), passed=True, by="Sato") for key in CHECKED)
    return sealed(structs.replace(record, checks=(*record.checks, *steps)))


def test_only_this_user_can_read_the_key(station: Path) -> None:
    assert mode_of(key_path(record_path(station))) == 0o600
    assert present(station).public_key


def test_a_value_that_was_changed_with_its_hash_is_noticed(station: Path) -> None:
    """The hash alone does not protect, because a person who changes a value can calculate the hash again."""
    record = present(station)
    changed = structs.replace(sealed(structs.replace(record, by="another person")), public_key=record.public_key)
    for signatures in (record.signatures, {changed.digest: record.signatures[record.digest]}, {}):
        store(structs.replace(changed, signatures=signatures), station)
        with pytest.raises(RecordError, match=r"station\.commissioning\.json was changed after it was written"):
            read_record(record_path(station))
        assert commissioning_status(station, CONFIG).missing == texts.RECORD_CHANGED()


def test_another_key_and_a_removed_signature_are_noticed(station: Path, tmp_path: Path) -> None:
    forged = tmp_path / "elsewhere.toml"
    write_record(sealed(structs.replace(present(station), by="another person")), record_path(forged))
    record_path(station).write_bytes(record_path(forged).read_bytes())
    with pytest.raises(RecordError, match="is not signed with this station's key"):
        read_record(record_path(station))
    store(sealed(present(forged)), station)
    with pytest.raises(RecordError, match="is not signed, but this station signs its records"):
        read_record(record_path(station))


def test_an_unsigned_record_is_signed_with_the_next_write(station: Path) -> None:
    key_path(record_path(station)).unlink()
    store(sealed(present(station)), station)
    assert signature_state(record_path(station).read_bytes()) == "unsigned"
    assert commissioning_status(station, CONFIG).missing is None
    write_record(with_check(present(station)), record_path(station))
    assert signature_state(record_path(station).read_bytes()) == "valid"


def test_a_moved_station_keeps_its_record(station: Path) -> None:
    """Without the key's file the record's own key counts. The next record makes a new key."""
    before = present(station)
    key_path(record_path(station)).unlink()
    assert present(station) == before
    after = write_record(with_check(before), record_path(station))
    assert present(station) == after and after.public_key != before.public_key


def test_each_part_has_its_signature(station: Path) -> None:
    record = write_record(with_check(with_check(present(station))), record_path(station))
    for part in (commissioning_part(record), *check_parts(record)):
        assert signature_state(msgspec.json.encode(part)) == "valid"
        other = sealed(structs.replace(part, by="another person"))
        forged = structs.replace(other, public_key=part.public_key, signatures=part.signatures)
        assert signature_state(msgspec.json.encode(forged)) == "invalid"


def test_the_print_says_whether_the_signature_is_valid(station: Path) -> None:
    options = PrintOptions(Letterhead("The clinic"), "en", "UTC", AT)
    record = present(station)
    assert "NOT VALID" not in commissioning_page(record, options, "valid").html
    assert record.public_key in commissioning_page(record, options, "valid").html
    assert "NOT VALID: the record was changed" in commissioning_page(record, options, "invalid").html


def test_no_step_runs_if_its_record_could_not_be_signed(station: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key_path(record_path(station)).write_text("damaged")
    with pytest.raises(SystemExit):
        cli.run_check(station, "Sato")
    assert "The record could not be written: the station's key" in capsys.readouterr().err


def test_no_step_runs_if_its_record_could_not_be_written(
    station: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != station.parent)
    with pytest.raises(SystemExit):
        cli.run_check(station, "Sato")
    assert "may not write to" in capsys.readouterr().err
