"""The reference builder: a process of its own that builds and checks references for the device process.

What takes a second, or fails in a way that nobody has thought of, happens here: the device process only passes a Load on, and
takes what came of it. The builder ends when the device process closes the socket or dies.
"""

import logging
import os
import signal
import socket
import sys
from typing import Final

from kata.system import scheduling

_NICENESS: Final = 5
"""Behind the service, and yet a quarter of a processor beside one busy process of it: somebody waits for the Load."""


def main() -> int:
    """Entry of ``python -m kata.device.reference_builder SOCKET``, a file descriptor of a SOCK_SEQPACKET socket."""
    _step_back()
    # Imported now: a builder that is started again must not import with the priority that it inherited.
    from kata.device.references import serve

    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s builder %(levelname)s %(message)s")
    # Ctrl-C in a terminal reaches the whole group; the device process decides when to end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with socket.socket(fileno=int(sys.argv[1])) as connection:
        serve(connection)
    return 0


def _step_back() -> None:
    """Take ordinary scheduling, behind the service, and a single thread for the linear algebra, whose equations are banded."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.nice(_NICENESS)
    scheduling.ask_for(scheduling.LONG_NS)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"


if __name__ == "__main__":
    sys.exit(main())
