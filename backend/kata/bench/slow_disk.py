"""Runs ``kata.device`` with a journal disk that blocks every other second."""

import sys
import time
from typing import Final

from kata.device import process
from kata.device.journal import Files

_BLOCKED_S: Final = 1.0
_write = Files.write


def _write_slowly(self: Files, file: int, data: bytearray) -> int:
    elapsed_s = time.monotonic() % (2 * _BLOCKED_S)
    time.sleep(max(0.0, _BLOCKED_S - elapsed_s))
    return _write(self, file, data)


if __name__ == "__main__":
    Files.write = _write_slowly  # type: ignore[method-assign]
    sys.exit(process.main())
