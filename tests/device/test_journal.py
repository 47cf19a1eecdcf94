"""The journal: valid at any length, with no invented data."""

import errno
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from kata.device import journal
from kata.device.journal import (
    FolderInUseError,
    JournalDisk,
    JournalEnd,
    JournalError,
    JournalWriter,
    claimed,
    read,
)
from tests.support.journals import HEADER


def _writer(folder: Path, samples: int) -> JournalWriter:
    writer = JournalWriter(folder, HEADER, JournalDisk())
    for n in range(samples):
        writer.append_sample(
            journal.Sample(
                t_ns=n * 10_000_000,
                take=0,
                phase=journal.PHASE_PLAYING,
                path_s=n / 100,
                setpoint_deg=[n + 0.1 * axis for axis in range(5)],
                measured_deg=[n - 0.1 * axis for axis in range(5)],
                torque_nm=[0.5] * 5,
            )
        )
    return writer


def test_journal_is_read_back_as_written(tmp_path: Path) -> None:
    writer = _writer(tmp_path, 50)
    writer.write()
    assert not writer.sync()
    writer.finish(JournalEnd(reason="stopped", cause_code="estop_pressed", cause_message="Pressed."))
    assert not writer.sync()
    writer.write()
    assert writer.sync()

    recorded = read(writer.path)
    assert (recorded.kind, recorded.id, recorded.recording_id) == ("run", "a-run", "a-recording")
    assert recorded.started_at == HEADER.started_at
    assert recorded.t_ns.tolist() == [n * 10_000_000 for n in range(50)]
    assert recorded.measured_deg[7] == pytest.approx([7.0, 6.9, 6.8, 6.7, 6.6])
    assert recorded.setpoint_deg.shape == (50, 5)
    assert recorded.end == JournalEnd(reason="stopped", cause_code="estop_pressed", cause_message="Pressed.")
    assert not recorded.truncated


def _whole(folder: Path) -> tuple[bytes, int, int]:
    """Return a journal of four samples and an end, the end of its header, and the length of a sample's record."""
    writer = _writer(folder, 4)
    writer.write()
    length = writer.path.stat().st_size
    writer.finish(JournalEnd(reason="completed"))
    writer.write()
    data = writer.path.read_bytes()
    body = data.index(b"\n") + 1
    return data, body, (length - body) // 4


def test_journal_cut_at_any_byte_keeps_every_whole_record(tmp_path: Path) -> None:
    data, body, record = _whole(tmp_path)
    whole = read(_cut(tmp_path, data))
    for length in range(body):
        with pytest.raises(JournalError):
            read(_cut(tmp_path, data[:length]))
    for length in range(body, len(data) + 1):
        recorded = read(_cut(tmp_path, data[:length]))
        count = min(4, (length - body) // record)
        assert recorded.t_ns.tolist() == [n * 10_000_000 for n in range(count)]
        assert np.array_equal(recorded.measured_deg, whole.measured_deg[:count])
        assert (recorded.end is not None) == (length == len(data))
        assert recorded.truncated == (length not in (len(data), *(body + n * record for n in range(5))))


@pytest.mark.parametrize("flip", [0x01, 0x80, 0xFF])
def test_damaged_byte_ends_the_valid_part_at_its_record(tmp_path: Path, flip: int) -> None:
    data, body, record = _whole(tmp_path)
    for position in range(body, len(data)):
        damaged = bytearray(data)
        damaged[position] ^= flip
        recorded = read(_cut(tmp_path, bytes(damaged)))
        assert len(recorded.t_ns) == min(4, (position - body) // record)
        assert recorded.end is None
        assert recorded.truncated


@pytest.mark.parametrize(
    "data",
    [b"", b"hello\n", b'{"format":"kata-journal/2","id":"\xff"}\n', b'{"format":"kata-journal/9","kind":"run"}\n'],
)
def test_other_files_are_refused(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(JournalError, match="is not a journal"):
        read(_cut(tmp_path, data))


def test_a_full_ring_loses_and_counts_instead_of_waiting(tmp_path: Path) -> None:
    writer = _writer(tmp_path, 7000)
    assert writer.lost > 0
    writer.write()
    assert len(read(writer.path).t_ns) == 7000 - writer.lost
    assert np.all(np.diff(read(writer.path).t_ns) == 10_000_000)


def test_temporarily_full_disk_leaves_no_gap_in_the_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = _writer(tmp_path, 50)
    room = [200]
    write = os.write

    def full_after_a_while(file: int, data: bytearray) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        written = write(file, data[: room[0]])
        room[0] -= written
        return written

    monkeypatch.setattr(os, "write", full_after_a_while)
    with pytest.raises(OSError, match="No space"):
        writer.write()
    room[0] = 1_000_000
    writer.finish(JournalEnd(reason="completed"))
    writer.write()
    assert writer.sync()

    recorded = read(writer.path)
    assert len(recorded.t_ns) == 50
    assert recorded.end is not None
    assert not recorded.truncated


def test_two_journals_never_share_a_file(tmp_path: Path) -> None:
    _writer(tmp_path, 1).write()
    with pytest.raises(FileExistsError):
        _writer(tmp_path, 1).write()


def _cut(folder: Path, data: bytes) -> Path:
    path = folder / "cut.journal"
    path.write_bytes(data)
    return path


def test_folder_belongs_to_one_process_at_a_time(tmp_path: Path) -> None:
    with (
        claimed(tmp_path, 0.0),
        pytest.raises(FolderInUseError, match="in use by another Kata"),
        claimed(tmp_path, 0.05),
    ):
        pass
    with claimed(tmp_path, 0.0):
        pass


def test_journal_of_an_earlier_version_is_readable() -> None:
    """Written byte by byte: the names of classes and modules are no part of the format."""

    def record(kind: int, payload: bytes) -> bytes:
        framed = struct.pack("<BH", kind, len(payload)) + payload
        return framed + struct.pack("<I", zlib.crc32(framed, zlib.crc32(header)))

    header = (
        b'{"format":"kata-journal/2","kind":"run","id":"r","recording_id":"c","station":"S","rate_hz":100,'
        b'"started_at":"2026-01-02T03:04:05Z","started_ns":7}\n'
    )
    sample = struct.pack("<qIBd15f", 8, 0, 7, 0.25, *[1.0] * 5, *[2.0] * 5, *[3.0] * 5)
    end = b'{"reason":"stopped","cause_code":"drive_garbled","cause_message":"m","cause_key":null}'
    found = journal.parse(header + record(1, sample) + record(2, end), "old")
    assert (found.kind, found.id, found.recording_id, found.rate_hz, found.started_ns) == ("run", "r", "c", 100, 7)
    assert (found.t_ns[0], found.phase[0], found.path_s[0]) == (8, journal.PHASE_REDUCED_RANGE, 0.25)
    assert (found.setpoint_deg[0, 0], found.measured_deg[0, 0], found.torque_nm[0, 0]) == (1.0, 2.0, 3.0)
    assert found.end is not None
    assert (found.end.reason, found.end.cause_code, found.truncated) == ("stopped", "drive_garbled", False)
