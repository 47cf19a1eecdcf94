"""A killed device process, a killed service and a full disk, in real processes."""

import resource
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from kata.clinic.sessions import runs
from kata.device import journal
from kata.device.ipc_messages import Acknowledge
from kata.device.movement import RAMP_S
from tests.support.device_kills import KeptClinic, hang_up_while_playing, kill_at_random, play
from tests.support.rig import Rig
from tests.support.service_kills import KilledClinic

CYCLE_S = 0.01


def test_killed_device_process_leaves_one_readable_journal_and_still_drives(tmp_path: Path) -> None:
    with closing(KeptClinic(tmp_path)) as clinic:
        # Once in playback and once in teaching.
        for seed in range(2):
            kill_at_random(clinic, seed).judge()


def test_killed_service_leaves_a_ramp_and_no_torque_within_300ms(tmp_path: Path) -> None:
    with closing(KeptClinic(tmp_path)) as clinic:
        for after_s in (0.4, 1.1):
            off_ms = hang_up_while_playing(clinic, after_s)
            assert min(off_ms) >= 150.0
            assert max(off_ms) <= 300.0


def test_service_killed_while_writing_keeps_every_acknowledged_change(tmp_path: Path) -> None:
    assert KilledClinic(tmp_path).kill(0.3).acknowledged > 0


@pytest.mark.parametrize("room_comes_back", [True, pytest.param(False, marks=pytest.mark.campaign)])
def test_full_disk_stops_playback_and_keeps_the_measured_samples(tmp_path: Path, room_comes_back: bool) -> None:
    """The kernel refuses to let the journal grow, in the middle of a record."""
    with closing(KeptClinic(tmp_path)) as clinic:
        with closing(Rig(tmp_path)) as rig:
            run_id = play(rig, clinic, 0.5)
            path = rig.journals / f"run-{run_id}.journal"
            room = path.stat().st_size + 1234
            _, most = resource.prlimit(rig.device.pid, resource.RLIMIT_FSIZE)
            resource.prlimit(rig.device.pid, resource.RLIMIT_FSIZE, (room, most))
            rig.until_mode("stopped")
            rig.until(lambda: not any(axis.torque_on for axis in rig.hand.state().axes))

            assert rig.snapshot.stop is not None
            assert [cause.code for cause in rig.snapshot.stop.causes] == ["journal_fault"]
            refusal = rig.send(Acknowledge())
            assert refusal is not None
            assert path.stat().st_size == room
            if room_comes_back:
                resource.prlimit(rig.device.pid, resource.RLIMIT_FSIZE, (most, most))
                rig.until(lambda: rig.closed == [path])
                rig.until(lambda: "acknowledge" not in rig.snapshot.refusals)
                assert rig.send(Acknowledge()) is None
                rig.until_mode("idle")
            rig.hang_up()
            assert rig.device.wait(10) == 0
        journal_read = journal.read(path)
        clinic.importer.run_at_start()
        with clinic.database.read() as session:
            run = runs.get(session, run_id)
            assert run.outcome == ("stopped" if room_comes_back else "interrupted")
            assert run.stop_code == ("journal_fault" if room_comes_back else None)
            assert run.samples == np.sum(journal_read.phase == journal.PHASE_PLAYING) >= 50
        assert journal_read.truncated != room_comes_back
        stopping_s = journal_read.t_ns[journal_read.phase == journal.PHASE_STOPPING] / 1e9
        if room_comes_back:
            # From full speed to a standstill by the drives' clock. A busy computer skips cycles, which does not shorten the ramp.
            last_played_s = journal_read.t_ns[journal_read.phase == journal.PHASE_PLAYING][-1] / 1e9
            assert stopping_s[-1] - last_played_s >= RAMP_S - 2 * CYCLE_S
        else:
            assert not len(stopping_s)
