"""A process that goes on beside a measurement, and says at its end what came of it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from kata.bench.clinic import BenchError


@dataclass
class Said:
    """What such a process has said last, once it has ended."""

    last: str = ""


@contextmanager
def beside(module: str, *arguments: str, sorry: str) -> Iterator[Said]:
    """``python -m module`` while the block lasts. It says "ready" when it is, and its last word when its input is closed.

    :raises BenchError: with ``sorry``, when it does not get ready.
    """
    said = Said()
    command = [sys.executable, "-m", module, *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            if process.stdout.readline() != "ready\n":
                raise BenchError(sorry)
            yield said
        finally:
            process.stdin.close()
            said.last = process.stdout.read()
