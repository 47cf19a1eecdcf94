"""The reference builder: a process that builds and checks references for the device process.

Work that takes a second, or that may fail in an unforeseen way, runs here. The device process only passes a Load on and
takes the result. The builder ends when the device process closes the socket or dies.
"""

import logging
import os
import signal
import socket
import sys
from typing import Final

from kata.system import scheduling

_NICENESS: Final = 5
"""Below the service's priority, but still a quarter of a processor beside one busy process of it: a therapist waits for
the Load.
"""


def main() -> int:
    """Run ``python -m kata.device.reference_builder SOCKET``, a file descriptor of a SOCK_SEQPACKET socket."""
    _step_back()
    # Imported after the priority has changed: a restarted builder must not import with the priority that it inherited.
    from kata.device.references import serve

    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s builder %(levelname)s %(message)s")
    # Ctrl-C in a terminal reaches the whole process group; the device process decides when the builder ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with socket.socket(fileno=int(sys.argv[1])) as connection:
        serve(connection)
    return 0


def _step_back() -> None:
    """Take ordinary scheduling below the service, and one thread for linear algebra, because the equations are banded."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.nice(_NICENESS)
    scheduling.set_time_slice(scheduling.LONG_NS)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"


if __name__ == "__main__":
    sys.exit(main())
