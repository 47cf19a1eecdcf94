"""A process that goes on beside a measurement, and says at its end what came of it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from kata.bench.running_service import BenchError


@dataclass
class HelperOutput:
    """What such a process has said last, once it has ended."""

    text: str = ""


@contextmanager
def helper_process(module: str, *arguments: str, failure: str) -> Iterator[HelperOutput]:
    """``python -m module`` while the block lasts. It says "ready" when it is, and its last word when its input is closed.

    :raises BenchError: with ``failure``, when it does not get ready.
    """
    output = HelperOutput()
    command = [sys.executable, "-m", module, *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            if process.stdout.readline() != "ready\n":
                raise BenchError(failure)
            yield output
        finally:
            process.stdin.close()
            output.text = process.stdout.read()
