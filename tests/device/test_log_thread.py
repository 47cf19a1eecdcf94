"""The control thread does not wait for the log's disk."""

import io
import logging
import threading

from kata.device.process import log_thread


class _SlowDisk(io.StringIO):
    """A file whose writes wait for the test."""

    def __init__(self) -> None:
        super().__init__()
        self.free = threading.Event()

    def write(self, text: str) -> int:
        self.free.wait()
        return super().write(text)


def test_logging_does_not_wait_for_a_slow_disk() -> None:
    disk = _SlowDisk()
    with log_thread(disk):
        for number in range(3):
            logging.getLogger("kata.device.state_machine").info("event %d", number)
        assert disk.getvalue() == ""
        disk.free.set()
    lines = disk.getvalue().splitlines()
    assert [line.rpartition(" ")[2] for line in lines] == ["0", "1", "2"]
    assert "device INFO event 0" in lines[0]
