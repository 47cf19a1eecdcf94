"""Records of the station are stored on disk at once and in the database exactly once and in order, also after failures."""

import errno
import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Column, Integer, MetaData, String, Table, select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from kata.database.base import utc_now
from kata.database.delivery import Delivery, SpoolRow
from kata.database.engine import Database
from kata.database.spool import Record, Spool, SpoolError, read

ARRIVED = Table(
    "arrived", MetaData(), Column("place", Integer, primary_key=True), Column("what", String, nullable=False)
)


def filled(folder: Path, *payloads: str, **given: Any) -> Spool:
    made = Spool(folder, retry_s=0.01, **given)
    for payload in payloads:
        made.put(payload.encode())
    assert made.until_written(10)
    return made


def answer(records: Sequence[Record]) -> list[str]:
    return [record.payload.decode() for record in records]


def the_file(folder: Path) -> Path:
    return max(folder.glob("*.spool"))


def test_spool_cut_at_any_byte_yields_everything_before(tmp_path: Path) -> None:
    payloads = ["first", "second, which is longer", "", "third"]
    filled(tmp_path, *payloads).close()
    data = the_file(tmp_path).read_bytes()
    ends = [data.index(b"\n") + 1]
    for payload in payloads:
        ends.append(ends[-1] + 8 + len(payload))
    assert ends[-1] == len(data)
    cut = tmp_path / "cut" / "000000000001.spool"
    cut.parent.mkdir()
    for size in range(len(data) + 1):
        cut.write_bytes(data[:size])
        part = read(cut)
        whole = sum(size >= end for end in ends[1:])
        assert (part is None) == (size < ends[0])
        assert answer(part.records if part else []) == payloads[:whole], size


def test_wrong_byte_yields_everything_before_it(tmp_path: Path) -> None:
    payloads = ["first", "second", "third"]
    filled(tmp_path, *payloads).close()
    file = the_file(tmp_path)
    data = file.read_bytes()
    header = data.index(b"\n") + 1
    for at in range(header, len(data)):
        file.write_bytes(data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :])
        part = read(file)
        assert part
        assert answer(part.records) == payloads[: len(part.records)]
        assert len(part.records) < 3


def test_spool_continues_behind_a_torn_entry(tmp_path: Path) -> None:
    filled(tmp_path, "a", "b").close()
    file = the_file(tmp_path)
    file.write_bytes(file.read_bytes()[:-1])
    again = filled(tmp_path, "c", "d")
    assert [(record.number, record.payload.decode()) for record in again.after(0, 10)] == [(1, "a"), (2, "c"), (3, "d")]
    again.close()


def test_files_rotate_and_imported_ones_are_deleted(tmp_path: Path) -> None:
    made = Spool(tmp_path, max_file_bytes=200, retry_s=0.01)
    for n in range(50):
        made.put(f"{n:03d}".encode())
        assert made.until_written(10)
    assert len(list(tmp_path.glob("*.spool"))) > 3
    assert answer(made.after(0, 1000)) == [f"{n:03d}" for n in range(50)]
    assert answer(made.after(20, 5)) == [f"{n:03d}" for n in range(20, 25)]
    made.delete_up_to(30)
    assert answer(made.after(30, 1000)) == [f"{n:03d}" for n in range(30, 50)]
    made.delete_up_to(50)
    assert len(list(tmp_path.glob("*.spool"))) == 1
    made.close()
    again = filled(tmp_path, "next")
    assert [record.number for record in again.after(50, 10)] == [51]
    assert again.id == made.id
    again.close()


def test_folder_of_another_owner_is_refused(tmp_path: Path) -> None:
    (tmp_path / "000000000001.spool").write_text('{"format":"kata-spool/9"}\n')
    with pytest.raises(SpoolError, match="this version cannot read"):
        Spool(tmp_path)


def test_full_disk_is_reported_and_nothing_is_written_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = filled(tmp_path, "before")
    write, full, tried = os.write, threading.Event(), threading.Semaphore(0)
    full.set()

    def taking_some(file: int, data: bytes) -> int:
        if full.is_set():
            tried.release()
            if len(data) > 12:
                return write(file, data[:12])
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", taking_some)
    made.put(b"one")
    made.put(b"two")
    assert all(tried.acquire(timeout=10) for _ in range(3))
    assert made.full_since is not None
    assert made.unwritten == 2
    full.clear()
    assert made.until_written(10)
    made.put(b"after")
    assert made.until_written(10)
    assert made.full_since is None
    assert [(record.number, record.payload) for record in made.after(0, 10)] == [
        (1, b"before"), (2, b"one"), (3, b"two"), (4, b"after"),
    ]  # fmt: skip
    made.close()


class Clinic:
    """A database with a table of delivered records."""

    def __init__(self, database: Database, folder: Path) -> None:
        self.database, self.folder = database, folder
        with database.writer.begin() as connection:
            ARRIVED.create(connection)
        self.failures: list[Exception] = []
        self.tried = threading.Semaphore(0)

    def take(self, session: Session, records: Sequence[Record]) -> int:
        self.tried.release()
        if self.failures:
            raise self.failures.pop()
        for record in records:
            session.execute(ARRIVED.insert().values(what=record.payload.decode() or None))
        return len(records)

    def delivery(self, spool: Spool) -> Delivery:
        return Delivery(spool, self.database, "Station 1", self.take, retry_s=0.01)

    def arrived(self) -> list[str]:
        with self.database.read() as session:
            return list(session.scalars(select(ARRIVED.c.what).order_by(ARRIVED.c.place)))


@pytest.fixture
def clinic(database: Database, tmp_path: Path) -> Clinic:
    return Clinic(database, tmp_path)


def test_everything_arrives_once_and_in_order_over_failures_and_starts(clinic: Clinic, tmp_path: Path) -> None:
    expected: list[str] = []
    for start in range(3):
        clinic.failures = [OperationalError("", None, Exception("gone")) for _ in range(2)]
        spool = filled(tmp_path / "spool")
        delivery = clinic.delivery(spool)
        for n in range(100):
            expected.append(f"{start}-{n}")
            spool.put(expected[-1].encode())
        assert delivery.until_taken(20)
        assert delivery.waiting == 0
        delivery.close(5)
        spool.close()
    assert clinic.arrived() == expected


def test_its_end_waits_for_no_next_look(clinic: Clinic, tmp_path: Path) -> None:
    spool = filled(tmp_path / "spool", "a")
    looked = threading.Semaphore(0)
    delivery = Delivery(spool, clinic.database, "Station 1", clinic.take, retry_s=600, each_round=looked.release)
    assert looked.acquire(timeout=20)
    ending = threading.Thread(target=delivery.close, args=(5,), daemon=True)
    ending.start()
    ending.join(20)
    assert not ending.is_alive()
    spool.close()
    assert clinic.arrived() == ["a"]


def _crashed(*_: object) -> None:
    raise RuntimeError("crashed")


def test_crash_between_commit_and_files_imports_nothing_twice(
    clinic: Clinic, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spool = filled(tmp_path / "spool", "a", "b")
    with monkeypatch.context() as patch:
        patch.setattr(Delivery, "_set_delivered", lambda *_: None)
        delivery = clinic.delivery(spool)
        limit = time.monotonic() + 30
        while clinic.arrived() != ["a", "b"]:
            assert time.monotonic() < limit
        # The exception simulates a crash at this point.
        patch.setattr(Delivery, "_deliver", _crashed)
        delivery.close(0)
    spool.close()
    assert clinic.arrived() == ["a", "b"]
    spool = filled(tmp_path / "spool", "c")
    delivery = clinic.delivery(spool)
    assert delivery.until_taken(20)
    delivery.close(5)
    spool.close()
    assert clinic.arrived() == ["a", "b", "c"]


def test_commit_with_a_lost_answer_is_found_in_place(
    clinic: Clinic, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server commits, and the connection breaks before its answer arrives."""
    spool = filled(tmp_path / "spool", "a", "b")
    deliver = Delivery._deliver
    lost: list[bool] = []

    def losing(self: Delivery, at_once: int) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(Delivery, "_set_delivered", lambda *_: None)
            if not lost:
                lost.append(True)
                deliver(self, at_once)
                raise OperationalError("", None, Exception("connection lost"))
        deliver(self, at_once)

    monkeypatch.setattr(Delivery, "_deliver", losing)
    delivery = clinic.delivery(spool)
    assert delivery.until_taken(20)
    delivery.close(5)
    spool.close()
    assert clinic.arrived() == ["a", "b"]


def test_rows_the_database_refuses_are_set_aside_without_blocking(clinic: Clinic, tmp_path: Path) -> None:
    spool = filled(tmp_path / "spool", "a", "", "c")
    delivery = clinic.delivery(spool)
    assert delivery.until_taken(20)
    delivery.close(5)
    spool.close()
    assert clinic.arrived() == ["a", "c"]
    assert (tmp_path / "spool" / "refused.jsonl").read_bytes() == b"\n"


def test_spool_restored_to_an_older_state_loses_nothing_new(clinic: Clinic, tmp_path: Path) -> None:
    spool = filled(tmp_path / "spool", "a")
    with clinic.database.write() as session:
        session.add(SpoolRow(id=spool.id, station="Station 1", taken=7, at=utc_now()))
    spool.close()
    spool = filled(tmp_path / "spool", "b")
    delivery = clinic.delivery(spool)
    assert delivery.until_taken(20)
    delivery.close(5)
    spool.close()
    assert clinic.arrived() == ["b"]
