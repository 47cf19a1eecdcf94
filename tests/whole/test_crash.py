"""The device process is killed, its service is killed, its disk is full: in real processes."""

from contextlib import closing
from pathlib import Path

from tests.whole.kills import KeptClinic, kill_at_random


def test_a_killed_device_process_loses_one_sample_at_most_and_its_drives_stop(tmp_path: Path) -> None:
    with closing(KeptClinic(tmp_path)) as clinic:
        for seed in range(4):
            kill_at_random(clinic, seed).judge()
