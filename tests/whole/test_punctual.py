"""What keeps the device process punctual, looked at from outside."""

import subprocess
import sys
from contextlib import closing
from pathlib import Path

from kata.device.messages import Load
from kata.motion.taught import Taught
from tests.conftest import ROOT
from tests.whole.rig import Rig
from tests.whole.test_job import known

_PAGES = 4096
"""16 MB."""
_HELP = """
import sys
from kata.__main__ import main
sys.argv = ["kata", "--help"]
try:
    main()
except SystemExit:
    print(open("/proc/self/status").read())
"""


def pages_asked_for(pid: int) -> int:
    """So far."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[7])


def test_the_first_recording_makes_the_device_process_ask_for_little_memory(tmp_path: Path, motion: Taught) -> None:
    """With its memory locked, each page is got at once, and the control thread waits."""
    with closing(Rig(tmp_path)) as rig:
        rig.until_mode("idle")
        before = pages_asked_for(rig.device.pid)
        times_s, angles_deg = (values.astype("<f8").tobytes() for values in known(motion))
        assert rig.send(Load(run_id="run", recording_id="a", times_s=times_s, angles_deg=angles_deg)) is None
        assert pages_asked_for(rig.device.pid) - before < _PAGES


def test_the_device_process_has_no_huge_pages_made(tmp_path: Path) -> None:
    with closing(Rig(tmp_path)) as rig:
        rig.until_mode("idle")
        assert "THP_enabled:\t0" in Path(f"/proc/{rig.device.pid}/status").read_text()


def test_a_command_and_what_it_starts_have_no_huge_pages_made() -> None:
    done = subprocess.run([sys.executable, "-c", _HELP], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "THP_enabled:\t0" in done.stdout
