"""Runs a module in a separate process during a measurement and reads its result."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from kata.bench.running_service import BenchError


@dataclass
class HelperOutput:
    """The last output of a helper process. It is empty until the process has ended."""

    text: str = ""


@contextmanager
def helper_process(module: str, *arguments: str, failure: str) -> Iterator[HelperOutput]:
    """Run ``python -m module`` during the block. The module must first print "ready", and its result when its input is closed.

    :raises BenchError: with ``failure`` as its message, when the process does not become ready.
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
