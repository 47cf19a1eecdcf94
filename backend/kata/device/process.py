"""The device process: sets itself up for real time, runs the control loop, ends with torque off."""

import argparse
import gc
import logging
import os
import signal
import socket
import sys
import threading
import time
from pathlib import Path
from typing import Final

from kata.device.bus.drivers import make_bus
from kata.device.config import ConfigError, StationConfig, read
from kata.device.exchange import Exchange
from kata.device.journal import Files, FolderInUseError, claimed
from kata.device.loop import ControlLoop

log = logging.getLogger(__name__)

_SWITCH_INTERVAL_S: Final = 50e-6
"""With Python's default of 5 ms, one busy sibling thread makes a 100 Hz thread that much late."""
_PRIORITY: Final = 60
_CLAIM_LIMIT_S: Final = 10.0
"""For the process before this one to come to its end."""


def main() -> int:
    """Entry of ``python -m kata.device``."""
    parser = argparse.ArgumentParser(prog="python -m kata.device", description=__doc__)
    parser.add_argument("--station", type=Path, required=True, help="the station's TOML file")
    parser.add_argument("--journal", type=Path, required=True, help="folder for journals")
    parser.add_argument("--socket", type=int, required=True, help="file descriptor of the service's socket")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s device %(levelname)s %(message)s")
    try:
        config = read(arguments.station)
        arguments.journal.mkdir(parents=True, exist_ok=True)
        Files().sync_folder(arguments.journal.parent)
    except (ConfigError, OSError) as error:
        log.error("%s", error)
        return 2
    try:
        with claimed(arguments.journal, _CLAIM_LIMIT_S):
            _run(config, Exchange(config, socket.socket(fileno=arguments.socket), arguments.journal))
    except FolderInUseError as error:
        log.error("%s", error)
        return 2
    log.info("ended")
    return 0


def _run(config: StationConfig, exchange: Exchange) -> None:
    def end(signum: int, frame: object) -> None:
        exchange.closing = True

    signal.signal(signal.SIGTERM, end)
    # Ctrl-C in a terminal reaches the whole group; ending is the service's to decide.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    control = threading.Thread(target=_control, args=(config, exchange), name="control")
    exchange.start()
    control.start()
    control.join()
    exchange.finish()


def _control(config: StationConfig, exchange: Exchange) -> None:
    loop = ControlLoop(config, make_bus(config), exchange, real_time=_become_real_time(), now_ns=time.monotonic_ns)
    loop.run()


def _become_real_time() -> bool:
    """Ask for SCHED_FIFO for the calling thread; tried, because no setting tells whether it will be granted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        log.warning("no real-time scheduling (%s): cycles may be late on a busy computer", error.strerror)
        return False
    return True
