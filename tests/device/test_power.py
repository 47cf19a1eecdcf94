"""A power cut at any moment: at most the last 100 ms are lost, and no read data is invented."""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
import pytest

from kata.device.ipc_messages import Acknowledge, Approach, Play
from kata.device.journal import PHASE_PLAYING, JournalEnd, JournalError, JournalHeader, JournalWriter, read
from kata.device.journal_set import JournalSet, next_sync_ns
from tests.support.cut_disk import CutDisk
from tests.support.journals import HEADER, MS, give, values
from tests.support.stepped import Stepped, SteppedServiceLink
from tests.support.trajectories import LOAD, a_trajectory

PERIOD_NS = 10 * MS
MAY_BE_LOST_NS = 100 * MS


class Session:
    """A journal written as in the device process: with each sample, synced when due."""

    def __init__(self, folder: Path, disk: CutDisk, header: JournalHeader = HEADER) -> None:
        self.folder = folder
        self.disk = disk
        self.given: list[int] = []
        self._journal_set = JournalSet(folder, disk)
        self._writer = self._journal_set.open(header)
        self._next_ns = 0
        self._end_ns = 0
        disk.meanwhile = self._measure

    @property
    def ok(self) -> bool:
        return self._journal_set.ok

    def run(self, *, begins_ns: int, lasts_ns: int, finish: bool = True) -> None:
        self._next_ns, self._end_ns = begins_ns, begins_ns + lasts_ns
        due_ns = 0
        while due_ns < self._end_ns:
            self._measure(due_ns)
            due_ns = self._sync()
        self._measure(self._end_ns)
        if finish:
            self._writer.finish(JournalEnd(reason="completed"))
            self._journal_set.write()
            self._sync()

    def _sync(self) -> int:
        began_ns = self.disk.now_ns
        self._journal_set.sync()
        return next_sync_ns(began_ns, self.disk.now_ns)

    def _measure(self, until_ns: int) -> None:
        """Run the control thread and the I/O thread, which continue while the disk is busy."""
        self._journal_set.write()
        while self._next_ns <= min(until_ns, self._end_ns - 1):
            self.disk.now_ns = self._next_ns
            give(self._writer, self._next_ns)
            self.given.append(self._next_ns)
            self._journal_set.write()
            self._next_ns += PERIOD_NS
        self.disk.now_ns = max(self.disk.now_ns, until_ns)

    def problems(self, stale: bytes = b"") -> set[str]:
        """Return the problems of all states that a power cut may leave, over every moment."""
        return {problem for t_ns, data in self.disk.states(stale) for problem in self._judged(t_ns, data)}

    def _judged(self, t_ns: int, data: bytes | None) -> Iterator[str]:
        recorded = [] if data is None else samples(self.folder, data)
        if recorded != [(t, values(t)) for t in self.given[: len(recorded)]]:
            yield "corrupt"
        old_enough = sum(t <= t_ns - MAY_BE_LOST_NS for t in self.given)
        if len(recorded) < old_enough:
            yield "lost"


def samples(folder: Path, data: bytes) -> list[tuple[int, list[float]]]:
    path = folder / "cut.journal"
    path.write_bytes(data)
    try:
        recorded = read(path)
    except JournalError:
        return []
    if recorded.id != HEADER.id:
        # The complete journal of an earlier file: it was imported by that name and is not imported twice.
        return []
    assert np.array_equal(recorded.measured_deg, recorded.setpoint_deg)
    return list(zip(recorded.t_ns.tolist(), recorded.measured_deg.tolist(), strict=True))


@pytest.mark.parametrize("sync_ms", [0, 3, 17, 49])
def test_a_power_cut_loses_at_most_100_ms(tmp_path: Path, sync_ms: int) -> None:
    disk = CutDisk(sync_ns=sync_ms * MS)
    session = Session(tmp_path, disk)
    # Nothing is measured before the pedal is pressed or an approach begins.
    session.run(begins_ns=150 * MS, lasts_ns=330 * MS)

    assert session.problems() == set()
    assert session.ok
    assert samples(tmp_path, bytes(disk.data)) == [(t, values(t)) for t in session.given]
    assert disk.synced == len(disk.data)


@pytest.mark.parametrize("most_at_once", [5, 50, 86])
def test_disk_writing_small_pieces_loses_no_more_samples(tmp_path: Path, most_at_once: int) -> None:
    session = Session(tmp_path, CutDisk(sync_ns=9 * MS, most_at_once=most_at_once, tried=2))
    session.run(begins_ns=30 * MS, lasts_ns=160 * MS)
    assert session.problems() == set()


def test_blocks_of_another_journal_are_not_read_as_this_ones(tmp_path: Path) -> None:
    older = Session(tmp_path, CutDisk(), msgspec.structs.replace(HEADER, id="b-run"))
    older.run(begins_ns=5 * MS, lasts_ns=330 * MS)
    session = Session(tmp_path, CutDisk(sync_ns=3 * MS))
    session.run(begins_ns=0, lasts_ns=330 * MS)
    assert session.problems(stale=bytes(older.disk.data)) == set()


def test_journal_is_on_disk_before_its_end_is_reported(tmp_path: Path) -> None:
    disk = CutDisk()
    journal_set = JournalSet(tmp_path, disk)
    writer = journal_set.open(HEADER)
    give(writer, 0)
    writer.finish(JournalEnd(reason="completed"))
    assert journal_set.sync() == []
    journal_set.write()
    assert journal_set.sync() == [writer.path]
    assert (disk.entered, disk.synced) == (True, len(disk.data))
    assert journal_set.sync() == []


# -- the proof of the proof: a disk that only says it syncs --------------------------------------------------------


class NoSync(CutDisk):
    def sync(self, file: int) -> None:
        self._pass(self.sync_ns)


class NoFolderSync(CutDisk):
    def sync_folder(self, folder: Path) -> None:
        self._pass(self.sync_ns)


class HalfTheSyncs(CutDisk):
    """Every other sync: as if the interval were 100 ms."""

    turn = 0

    def sync(self, file: int) -> None:
        self.turn += 1
        if self.turn % 2:
            super().sync(file)


@pytest.mark.parametrize(
    "disk", [NoSync(), NoFolderSync(), HalfTheSyncs(sync_ns=10 * MS)], ids=lambda d: type(d).__name__
)
def test_without_syncs_more_would_be_lost(tmp_path: Path, disk: CutDisk) -> None:
    session = Session(tmp_path, disk)
    session.run(begins_ns=150 * MS, lasts_ns=330 * MS)
    assert session.problems() == {"lost"}


def test_crc_with_the_header_excludes_samples_of_other_journals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crc32 = zlib.crc32
    monkeypatch.setattr(zlib, "crc32", lambda data, _seed=0: crc32(data))
    older = Session(tmp_path, CutDisk(), msgspec.structs.replace(HEADER, id="b-run"))
    older.run(begins_ns=5 * MS, lasts_ns=330 * MS)
    session = Session(tmp_path, CutDisk(sync_ns=3 * MS))
    session.run(begins_ns=0, lasts_ns=330 * MS)
    assert session.problems(stale=bytes(older.disk.data)) == {"corrupt"}


# -- a disk that will not have it ----------------------------------------------------------------------------------


@pytest.mark.parametrize("room", [0, 1, 100, 240, 241, 1000, 2021])
def test_full_disk_is_reported_and_keeps_its_data(tmp_path: Path, room: int) -> None:
    session = Session(tmp_path, CutDisk(room=room))
    session.run(begins_ns=0, lasts_ns=330 * MS)

    assert not session.ok
    recorded = samples(tmp_path, bytes(session.disk.data))
    assert recorded == [(t, values(t)) for t in session.given[: len(recorded)]]
    assert len(session.disk.data) == room
    # Every record except the one that found no room is read back, at that moment and after any power cut.
    assert session.problems() <= {"lost"}


@pytest.mark.parametrize("what", ["create", "write", "sync", "sync_folder"])
def test_passing_error_is_reported_and_the_retry_leaves_no_gap(tmp_path: Path, what: str) -> None:
    session = Session(tmp_path, CutDisk(failing={what}))
    session.run(begins_ns=0, lasts_ns=330 * MS, finish=False)

    assert not session.ok
    assert samples(tmp_path, bytes(session.disk.data)) == [(t, values(t)) for t in session.given]
    assert (session.disk.entered, session.disk.synced > 0) == (True, True)
    assert session.problems() <= {"lost"}


@dataclass
class OnThatDisk(SteppedServiceLink):
    """Writes in every cycle and syncs at once, as the two journal threads would."""

    disk: CutDisk = field(default_factory=CutDisk)

    def __post_init__(self) -> None:
        self.journal_set = JournalSet(self.folder, self.disk)

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        return self.journal_set.open(header)

    def wake(self) -> None:
        self.journal_set.write()
        self.journal_set.sync()
        self.journal_ok = self.journal_set.ok


def _fill(disk: CutDisk) -> None:
    disk.room = 1234


def _break_once(disk: CutDisk) -> None:
    disk.failing = {"sync"}


@pytest.mark.parametrize("happen", [_fill, _break_once])
def test_failing_disk_stops_the_playback_along_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, happen: Callable[[CutDisk], None]
) -> None:
    monkeypatch.setattr("tests.support.stepped.SteppedServiceLink", OnThatDisk)
    stepped = Stepped(tmp_path)
    link = stepped.link
    assert isinstance(link, OnThatDisk)
    assert stepped.send(LOAD, a_trajectory()) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    stepped.forward(0.5)
    before = len(link.disk.data)
    happen(link.disk)
    stepped.until("stopped", within_s=0.5)

    assert stepped.causes() == ["journal_fault"]
    assert stepped.torque
    stepped.forward(0.3)
    assert not stepped.torque
    (tmp_path / "run.journal").write_bytes(link.disk.data)
    recorded = read(tmp_path / "run.journal")
    assert np.sum(recorded.phase == PHASE_PLAYING) >= 50
    if happen is _fill:
        assert len(link.disk.data) == before + 1234
        assert (recorded.truncated, recorded.end) == (True, None)
        assert "acknowledge" in stepped.snapshot.refusals
        link.disk.room = 1 << 20
        stepped.forward(0.2)
    assert stepped.send(Acknowledge()) is None
    (tmp_path / "run.journal").write_bytes(link.disk.data)
    recorded = read(tmp_path / "run.journal")
    assert recorded.end is not None
    assert recorded.end.cause_code == "journal_fault"
    assert np.all(np.diff(recorded.t_ns) == 10 * MS)


def test_journal_closed_later_ends_the_fault(tmp_path: Path) -> None:
    session = Session(tmp_path, CutDisk(failing={"sync"}))
    session.run(begins_ns=0, lasts_ns=330 * MS)
    assert session.ok
