"""One `kill -9` of the device process and its effect on disk, database and arm."""

import os
import random
import shutil
import signal
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from uuid import UUID

import numpy as np
from sqlalchemy import func, select

from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RunRow, RunSamplesRow
from kata.database.engine import Database
from kata.device import journal
from kata.device.ipc_messages import Approach, Load, Play, Teach
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import motor_angles_deg
from tests.support.databases import upgraded_file
from tests.support.imported_runs import Clinic
from tests.support.rig import Rig

_WATCHED_S = 0.45
_STANDS_DEG_S = 1.0
_MOTION = built_in_motions()[1]
_LIMIT_MS = 200.0


@dataclass(frozen=True)
class Kill:
    """The effects of a kill. Times count from the signal, by the simulator's clock."""

    in_what: Literal["teaching", "playback"]
    missing: int
    """Samples that the simulator answered and the journal does not contain."""
    cut: bool
    """True if the last record was incomplete."""
    tripped_ms: float
    """Time at which the last drive's watchdog stopped it; NaN without torque."""
    moved_ms: float
    """Time of the last movement; NaN without torque."""

    def judge(self) -> None:
        """Raise an AssertionError for an effect that is forbidden on any computer. How many samples are missing depends on
        when a busy computer lets the writing thread run; the campaign judges it.
        """
        if self.in_what == "playback":
            assert max(self.tripped_ms, self.moved_ms) <= _LIMIT_MS, self


class KeptClinic(Clinic):
    """A station with its own database and recording."""

    def __init__(self, folder: Path) -> None:
        database = Database(upgraded_file(folder / "kata.db"))
        super().__init__(folder, database)
        self.played = self.recording()

    def close(self) -> None:
        self.database.close()


def kill_at_random(clinic: KeptClinic, seed: int) -> Kill:
    """Kill during teaching and playback in turns."""
    chance = random.Random(seed)
    if seed % 2:
        return kill_while_teaching(clinic, chance.uniform(0.55, 1.5))
    return kill_while_playing(clinic, chance.uniform(0.1, 1.5))


def kill_while_teaching(clinic: Clinic, after_s: float) -> Kill:
    """Kill ``after_s`` after the press of the pedal."""
    teaching = clinic.begin_teaching()
    before = clinic.count(RecordingRow)
    with closing(Rig(clinic.folder.parent)) as rig:
        rig.until_mode("idle")
        assert rig.send(Teach(teaching_id=str(teaching))) is None
        rig.hand.guide(_MOTION)
        rig.until(lambda: rig.snapshot.teaching and rig.snapshot.teaching.recording)
        until_s = time.monotonic() + after_s
        rig.until(lambda: time.monotonic() >= until_s)
        killed_ns = _kill(rig, after_s)
        time.sleep(_WATCHED_S)
        path = rig.journals / f"teaching-{teaching}.journal"
        recorded = journal.read(path)
        missing = _missing(rig, recorded)
        assert not any(axis.torque_on for axis in rig.hand.state().axes)
    assert recorded.t_ns[-1] <= killed_ns + 5_000_000
    _import_twice(clinic, path)
    new = clinic.count(RecordingRow) - before
    assert new == 1, f"{new} recordings came of one take"
    return Kill("teaching", missing, recorded.truncated, float("nan"), float("nan"))


def kill_while_playing(clinic: KeptClinic, after_s: float) -> Kill:
    """Kill ``after_s`` after the beginning of playback."""
    with closing(Rig(clinic.folder.parent)) as rig:
        run_id = play(rig, clinic, after_s)
        before = clinic.count(RunRow)
        killed_ns = _kill(rig, after_s)
        moved_ns = _watch(rig, killed_ns)
        tripped = [happening for happening in rig.happened("watchdog_tripped") if happening.t_ns >= killed_ns]
        assert {happening.motor for happening in tripped} == {1, 2, 3, 4, 5}
        tripped_ns = max(happening.t_ns for happening in tripped)
        path = rig.journals / f"run-{run_id}.journal"
        recorded = journal.read(path)
        missing = _missing(rig, recorded)
    _import_twice(clinic, path)
    assert clinic.count(RunRow) == before
    with clinic.database.read() as session:
        run = runs.get(session, run_id)
        assert (run.outcome, run.stop_code) == ("interrupted", None)
        assert run.samples == int(np.sum(recorded.phase == journal.PHASE_PLAYING))
        assert len(run.tracking) == 5
        held = select(func.count()).select_from(RunSamplesRow).where(RunSamplesRow.run_id == run_id)
        assert session.scalar(held) == 1
    return Kill("playback", missing, recorded.truncated, (tripped_ns - killed_ns) / 1e6, (moved_ns - killed_ns) / 1e6)


def hang_up_while_playing(clinic: KeptClinic, after_s: float) -> list[float]:
    """Close the socket like a killed service; return ms until all drives had no torque, by the simulator's clock."""
    with closing(Rig(clinic.folder.parent)) as rig:
        run_id = play(rig, clinic, after_s)
        killed_ns = time.monotonic_ns()
        rig.hang_up()
        assert rig.device.wait(10) == 0
        off = [happening for happening in rig.happened("torque_off") if happening.t_ns >= killed_ns]
        assert {happening.motor for happening in off} == {1, 2, 3, 4, 5}
        assert rig.happened("watchdog_tripped") == []
    clinic.importer.run_at_start()
    with clinic.database.read() as session:
        run = runs.get(session, run_id)
        assert (run.outcome, run.stop_code) == ("stopped", "service_silent")
    return [(happening.t_ns - killed_ns) / 1e6 for happening in off]


def play(rig: Rig, clinic: KeptClinic, until_s: float) -> UUID:
    """Play until this place on the path."""
    run_id = clinic.begin_run(clinic.played)
    rig.until_mode("idle")
    load = Load(
        run_id=str(run_id),
        recording_id=str(clinic.played),
        times_s=_MOTION.times_s.astype("<f8").tobytes(),
        angles_deg=motor_angles_deg(_MOTION.poses_deg).astype("<f8").tobytes(),
    )
    assert rig.send(load) is None
    assert rig.send(Approach()) is None
    rig.until_mode("paused")
    assert rig.send(Play()) is None
    rig.until(lambda: rig.snapshot.run and rig.snapshot.run.position_s >= until_s)
    return run_id


def _kill(rig: Rig, after_s: float) -> int:
    # A snapshot has just arrived, so a cycle has just ended: wait until a random phase of the next two cycles.
    time.sleep(after_s % 0.02)
    killed_ns = time.monotonic_ns()
    os.kill(rig.device.pid, signal.SIGKILL)
    rig.device.wait(10)
    return killed_ns


def _watch(rig: Rig, killed_ns: int) -> int:
    """Return the time of the last movement of any axis."""
    moved_ns = killed_ns
    while (state := rig.hand.state()).t_ns < killed_ns + int(_WATCHED_S * 1e9):
        if any(abs(axis.speed_deg_s) > _STANDS_DEG_S for axis in state.axes):
            moved_ns = state.t_ns
        time.sleep(0.002)
    return moved_ns


def _missing(rig: Rig, recorded: journal.Journal) -> int:
    """Return the complete cycles that the simulator received after the journal's last sample; check the journal's order."""
    steps_ns = np.diff(recorded.t_ns)
    assert np.all(steps_ns > 0)
    assert np.all(np.isfinite(recorded.measured_deg))
    silent = rig.happened("line_silent")[-1]
    return max(0, (silent.t_ns - int(recorded.t_ns[-1])) // (1_000_000_000 // recorded.rate_hz))


def _import_twice(clinic: Clinic, path: Path) -> None:
    """Import as at the next start, a second time, and as after a crash between the commit and the file's move."""
    clinic.importer.run_at_start()
    clinic.importer.run_at_start()
    shutil.copy(path.parent / "imported" / path.name, path)
    clinic.importer.run_at_start()
    assert list(path.parent.glob("*.journal")) == []
