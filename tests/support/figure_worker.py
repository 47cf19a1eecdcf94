"""Figure workers of tests: one that all services of this process share, and a task that kills its worker."""

import os
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

from kata.plotting.figures import FigureWorker

_Given = TypeVar("_Given")
_Built = TypeVar("_Built")


class SharedFigureWorker(FigureWorker):
    """The figure worker of a service in a test. All services of this process use one worker process, which takes two seconds to start.

    ``tests/clinic/test_figures.py`` tests how a service starts and ends its own worker.
    """

    def warm_up(self) -> None:
        """Do nothing: the process starts with the first task."""

    def build(self, what: Callable[..., _Built], *parts: object) -> _Built:
        return _shared().build(what, *parts)


@cache
def _shared() -> FigureWorker:
    return FigureWorker()


def calculate_or_die(calculate: Callable[[_Given], _Built], deaths: Path, most: int, given: _Given) -> _Built:
    """Kill the worker process ``most`` times, then calculate."""
    count = len(deaths.read_bytes()) if deaths.exists() else 0
    if count < most:
        deaths.write_bytes(b"." * (count + 1))
        os.kill(os.getpid(), signal.SIGKILL)
    return calculate(given)
