"""The device process on a disk that stands still every other second: ``python -m kata.bench.slow_disk ...`` as ``kata.device``."""

import sys
import time
from typing import Final

from kata.device import process
from kata.device.journal import Files

_STANDS_STILL_S: Final = 1.0
_write = Files.write


def _slowly(self: Files, file: int, data: bytearray) -> int:
    into_s = time.monotonic() % (2 * _STANDS_STILL_S)
    time.sleep(max(0.0, _STANDS_STILL_S - into_s))
    return _write(self, file, data)


if __name__ == "__main__":
    Files.write = _slowly  # type: ignore[method-assign]
    sys.exit(process.main())
