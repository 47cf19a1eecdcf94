"""Locked memory: what a process touches and its programs, not what it only reserves."""

import subprocess
import sys
from typing import Final

import pytest

from kata.system.privileges import memory_lock_granted
from tests.support.paths import ROOT

_LOCKED: Final = r"""
import mmap, re, sys
from pathlib import Path
import numpy
from kata.system import realtime

MB = 1 << 20


def locked_mb():
    return int(re.search(r"^Locked: +([0-9]+) kB", Path("/proc/self/smaps_rollup").read_text(), re.M)[1]) / 1024


assert realtime.lock_memory()
before = locked_mb()
reserved = mmap.mmap(-1, 64 * MB, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
only_reserved = locked_mb()
for page in range(0, 64 * MB, mmap.PAGESIZE):
    reserved[page] = 1
touched = locked_mb()
library = missing = 0
for text in re.split(r"(?m)^(?=[0-9a-f]+-)", Path("/proc/self/smaps").read_text()):
    if "libpython" in text or "_multiarray_umath" in text or "/bin/python" in text:
        if re.match(r"\S+ r-x", text):
            size, resident = (int(re.search(rf"^{name}: +([0-9]+) kB", text, re.M)[1]) for name in ("Size", "Rss"))
            library, missing = library + size, missing + size - resident
print(only_reserved - before, touched - before, library / 1024, missing / 1024)
"""


@pytest.fixture(scope="module")
def measured() -> list[float]:
    """Return MB: locked by reserving 64 MB, by touching them, code of Python and numpy, and the part of it that is not in memory."""
    if not memory_lock_granted():
        pytest.skip("this user may not lock memory")
    done = subprocess.run([sys.executable, "-c", _LOCKED], cwd=ROOT, capture_output=True, text=True, check=True)
    return [float(word) for word in done.stdout.split()]


def test_reserved_memory_is_locked_when_it_is_touched(measured: list[float]) -> None:
    only_reserved, touched, _, _ = measured
    assert only_reserved < 2.0
    assert touched > 60.0


def test_code_is_in_memory_before_its_first_use(measured: list[float]) -> None:
    _, _, library, missing = measured
    assert library > 1.0
    assert missing == 0.0
