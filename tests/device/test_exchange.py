"""Nobody waits for the disk but the thread that is there for it."""

import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kata.device.config import StationConfig
from kata.device.exchange import Exchange
from kata.device.journal import Files, JournalEnd, read
from kata.device.messages import Request, Stop, frame
from tests.device.test_journal import HEADER
from tests.device.test_power import give

LIMIT_S = 10.0


def until(condition: Callable[[], object]) -> None:
    limit = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.001)


def test_while_the_disk_is_busy_samples_are_written_and_a_stop_is_heard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    busy, may_end = threading.Event(), threading.Event()

    def slow(self: Files, file: int) -> None:
        busy.set()
        assert may_end.wait(LIMIT_S)

    monkeypatch.setattr(Files, "sync", slow)
    service, device = socket.socketpair()
    with service, device:
        exchange = Exchange(StationConfig(), device, tmp_path)
        exchange.start()
        writer = exchange.open_journal(HEADER)
        exchange.wake()
        assert busy.wait(LIMIT_S)

        for n in range(3):
            give(writer, n * 10_000_000)
            exchange.wake()
        service.sendall(frame(Request(id=1, command=Stop(because="browser_lost"))))
        until(lambda: len(read(writer.path).t_ns) == 3)
        reasons: list[object] = []

        def asked_to_stop() -> bool:
            reasons.append(exchange.take_stop())
            return bool(reasons[-1])

        until(asked_to_stop)
        assert reasons[-1] == "browser_lost"
        assert exchange.take_stop() is None
        assert not may_end.is_set()

        writer.finish(JournalEnd(reason="completed"))
        may_end.set()
        exchange.finish()
        assert read(writer.path).end is not None
        assert exchange.journal_ok


def test_a_journal_is_on_the_disk_when_the_process_ends_without_anybody_to_tell(tmp_path: Path) -> None:
    service, device = socket.socketpair()
    with device:
        exchange = Exchange(StationConfig(), device, tmp_path)
        exchange.start()
        service.close()
        until(lambda: exchange.closing)
        writer = exchange.open_journal(HEADER)
        give(writer, 0)
        writer.finish(JournalEnd(reason="completed"))
        exchange.finish()
        kept = read(writer.path)
    assert (len(kept.t_ns), kept.truncated) == (1, False)
    assert kept.end is not None
