"""Runs ``kata.device`` with a journal disk that is blocked in every second second."""

import sys
import time
from typing import Final

from kata.device import process
from kata.device.journal import JournalDisk

_BLOCKED_S: Final = 1.0
_write = JournalDisk.write


def _write_slowly(self: JournalDisk, file: int, data: bytearray) -> int:
    elapsed_s = time.monotonic() % (2 * _BLOCKED_S)
    time.sleep(max(0.0, _BLOCKED_S - elapsed_s))
    return _write(self, file, data)


if __name__ == "__main__":
    JournalDisk.write = _write_slowly  # type: ignore[method-assign]
    sys.exit(process.main())
