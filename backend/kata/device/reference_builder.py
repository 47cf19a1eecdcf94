"""Runs the reference builder, a process that builds and checks references for the device process.

Work that takes a second, or that may fail in an unforeseen way, runs in this process. The device process only sends a Load
and receives the result. The builder ends when the device process closes the socket or dies.
"""

import logging
import os
import signal
import socket
import sys
from typing import Final

from kata.system import malloc, scheduling
from kata.system.lazy_modules import delay_unused_numpy

_NICENESS: Final = 5
"""Gives the builder a lower priority than the service, but still a quarter of a processor if the service keeps that processor
busy, because a therapist waits for the Load.
"""


def main() -> int:
    """Run ``python -m kata.device.reference_builder SOCKET``, a file descriptor of a SOCK_SEQPACKET socket."""
    _step_back()
    malloc.return_free_memory()
    delay_unused_numpy()
    # Import only after the priority has changed, because a restarted builder inherits a real-time priority.
    from kata.device.references import serve

    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s builder %(levelname)s %(message)s")
    # Ctrl-C in a terminal signals the whole process group. Ignore it here: the device process decides when the builder ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with socket.socket(fileno=int(sys.argv[1])) as connection:
        serve(connection)
    return 0


def _step_back() -> None:
    """Set ordinary scheduling below the service's priority."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.nice(_NICENESS)
    scheduling.set_time_slice(scheduling.LONG_NS)


if __name__ == "__main__":
    sys.exit(main())
