"""Runs the device process: requests real-time scheduling, runs the control loop, and ends with torque off."""

import argparse
import contextlib
import logging
import logging.handlers
import queue
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final, TextIO

from kata.device.bus.factory import make_bus
from kata.device.config import ConfigError, StationConfig, read
from kata.device.ipc import SocketServiceLink
from kata.device.journal import FolderInUseError, JournalDisk, claimed
from kata.device.journal_set import JournalSet
from kata.device.loader import ReferenceLoader
from kata.device.loop import ControlLoop
from kata.system import realtime

log = logging.getLogger(__name__)

_JOURNAL_LOCK_LIMIT_S: Final = 10.0
"""Longest wait for the previous device process to end."""


def main() -> int:
    """Run ``python -m kata.device``. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m kata.device", description=__doc__)
    parser.add_argument("--station", type=Path, required=True, help="the station's TOML file")
    parser.add_argument("--journal", type=Path, required=True, help="folder for journals")
    parser.add_argument("--socket", type=int, required=True, help="file descriptor of the service's socket")
    parser.add_argument(
        "--no-real-time", action="store_true", help="ask for no real-time privileges, as if none were granted"
    )
    arguments = parser.parse_args()
    with log_thread(sys.stderr):
        return _run_station(arguments)


@contextlib.contextmanager
def log_thread(stream: TextIO) -> Iterator[None]:
    """Let a thread write the log to ``stream``, until the end of the context. The control thread then never waits for a slow disk."""
    records: queue.SimpleQueue[logging.LogRecord] = queue.SimpleQueue()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logging.Formatter("%(asctime)s device %(levelname)s %(message)s"))
    listener = logging.handlers.QueueListener(records, handler)
    enqueue = logging.handlers.QueueHandler(records)
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    root.addHandler(enqueue)
    listener.start()
    try:
        yield
    finally:
        listener.stop()
        root.removeHandler(enqueue)


def _run_station(arguments: argparse.Namespace) -> int:
    try:
        config = read(arguments.station)
        arguments.journal.mkdir(parents=True, exist_ok=True)
        JournalDisk().sync_folder(arguments.journal.parent)
    except (ConfigError, OSError) as error:
        log.error("%s", error)
        return 2
    try:
        with claimed(arguments.journal, _JOURNAL_LOCK_LIMIT_S):
            # Start the builder first, so that it does not inherit the real-time settings.
            loader = ReferenceLoader(config)
            connection = socket.socket(fileno=arguments.socket)
            link = SocketServiceLink(config, connection, JournalSet(arguments.journal), loader)
            _run(config, link, loader, wants_real_time=not arguments.no_real_time)
    except FolderInUseError as error:
        log.error("%s", error)
        return 2
    log.info("ended")
    return 0


def _run(config: StationConfig, link: SocketServiceLink, loader: ReferenceLoader, *, wants_real_time: bool) -> None:
    def end(signum: int, frame: object) -> None:
        link.closing = True

    signal.signal(signal.SIGTERM, end)
    # Ctrl-C in a terminal signals the whole process group. Ignore it here: the service decides when this process ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    realtime.prepare_interpreter()
    memory_locked = wants_real_time and realtime.lock_memory()
    # The other threads inherit this priority.
    scheduled = wants_real_time and realtime.schedule(realtime.IO_PRIORITY)
    control = threading.Thread(target=_control, args=(config, link, scheduled, memory_locked), name="control")
    loader.start(link.notify)
    link.start()
    control.start()
    control.join()
    loader.finish()
    link.finish()


def _control(config: StationConfig, link: SocketServiceLink, scheduled: bool, memory_locked: bool) -> None:
    ControlLoop(
        config,
        make_bus(config),
        link,
        realtime.Granted(scheduled and realtime.schedule(realtime.CONTROL_PRIORITY), memory_locked),
        now_ns=time.monotonic_ns,
    ).run()
