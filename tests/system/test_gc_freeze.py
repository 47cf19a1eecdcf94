"""Permanent objects are excluded from garbage collection."""

import gc
import subprocess
import sys

import pytest

from kata.system.gc_freeze import permanent_objects


def test_permanent_objects_are_not_scanned() -> None:
    program = """
import gc
from kata.system.gc_freeze import permanent_objects

with permanent_objects():
    assert not gc.isenabled()
    permanent = [{} for _ in range(1000)]
later = []
tracked = gc.get_objects()
print(any(found is permanent for found in tracked), any(found is later for found in tracked), gc.isenabled())
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["False", "True", "True"]


def test_the_collector_works_again_after_an_error() -> None:
    with pytest.raises(ValueError, match="no import"), permanent_objects():
        raise ValueError("no import")
    assert gc.isenabled()
