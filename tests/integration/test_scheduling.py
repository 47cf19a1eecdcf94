"""Settings of the operating system that keep the device process punctual, seen from outside."""

import platform
import re
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from kata.device.ipc_messages import Load
from kata.motion.taught import Taught
from kata.system import scheduling
from tests.support.motion_samples import known
from tests.support.paths import ROOT
from tests.support.rig import Rig

_PAGES = 4096
"""16 MB."""
_HELP = """
import sys
from kata.__main__ import main
file, sys.argv = sys.argv[1], ["kata", "--help"]
try:
    main()
except SystemExit:
    print(open(file).read())
"""
_SETTLED = """
from kata.system import scheduling
from kata.system.realtime import prepare_interpreter
scheduling.set_time_slice(scheduling.LONG_NS)
prepare_interpreter()
print(open("/proc/self/sched").read())
"""
_SIMULATED = """
import os, sys
from kata.simulator.process import main
def refused(*_):
    raise PermissionError
os.sched_setscheduler = refused
sys.argv[1:] = ["--control", sys.argv[1], "--plant", "none"]
main()
print(open("/proc/self/sched").read())
"""
_TURNS_HEEDED = (6, 12)
"""The first Linux version that respects a requested scheduler slice."""


def pages_asked_for(pid: int) -> int:
    """Return how many pages the process has asked for."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[7])


def test_first_recording_needs_little_memory_in_the_device_process(tmp_path: Path, motion: Taught) -> None:
    """With locked memory the kernel provides each page at once, and the control thread waits for it."""
    with closing(Rig(tmp_path)) as rig:
        rig.until_mode("idle")
        before = pages_asked_for(rig.device.pid)
        times_s, angles_deg = (values.astype("<f8").tobytes() for values in known(motion))
        assert rig.send(Load(run_id="run", recording_id="a", times_s=times_s, angles_deg=angles_deg)) is None
        assert pages_asked_for(rig.device.pid) - before < _PAGES


def test_device_process_has_huge_pages_disabled(tmp_path: Path) -> None:
    with closing(Rig(tmp_path)) as rig:
        rig.until_mode("idle")
        assert "THP_enabled:\t0" in Path(f"/proc/{rig.device.pid}/status").read_text()


def test_commands_and_their_children_have_huge_pages_disabled() -> None:
    assert "THP_enabled:\t0" in said(_HELP, "/proc/self/status")


@pytest.fixture
def kernel_that_heeds_turns() -> None:
    version = tuple(int(number) for number in platform.release().split(".")[:2])
    if version < _TURNS_HEEDED or not Path("/proc/self/sched").exists():
        pytest.skip("this kernel does not respect scheduler slices, or does not show them")


@pytest.mark.usefixtures("kernel_that_heeds_turns")
def test_only_timed_processes_have_short_scheduler_slices(tmp_path: Path) -> None:
    """Kernel threads that deliver the bus's bytes have slices between the two, and so preempt the processes with long ones at once."""
    assert turn_ns(said(_HELP, "/proc/self/sched")) == scheduling.LONG_NS
    assert turn_ns(said(_SETTLED)) == scheduling.SHORT_NS
    assert turn_ns(said(_SIMULATED, str(tmp_path / "simulator.sock"))) == scheduling.SHORT_NS


def said(program: str, *arguments: str) -> str:
    """Return the output of a program in a new Python process without input."""
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(
        command, cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True
    ).stdout


def turn_ns(sched: str) -> int:
    """Return the scheduler slice from the kernel's text."""
    slice_ns = re.search(r"se\.slice +: +(\d+)", sched)
    assert slice_ns
    return int(slice_ns[1])
