"""Sets real-time properties of the control thread. Each setting is tried, never inferred. A refused setting is one line in
the log.

Scheduling is a property of a thread, the other settings are properties of the process.
"""

import ctypes
import gc
import logging
import mmap
import os
import resource
import sys
from pathlib import Path
from typing import Final, NamedTuple

from kata.system import scheduling

log = logging.getLogger(__name__)

_SWITCH_INTERVAL_S: Final = 50e-6
"""Switch interval of the interpreter. With Python's default of 5 ms, a busy thread delays the 100 Hz thread by 5 ms."""
CONTROL_PRIORITY: Final = 60
"""Priority of the control thread. The kernel's own interrupt threads have 50."""
IO_PRIORITY: Final = 10
"""Priority of the other threads. It is below that of the control thread and above everything that is not real time: if a busy
computer suspends a thread that holds the interpreter's lock, the control thread waits for that long (3 ms at p99 under load,
measured).
"""
_MCL_CURRENT: Final = 1
_MCL_FUTURE: Final = 2
_MCL_ONFAULT: Final = 4
_POPULATE_READ: Final = 22
"""Value of MADV_POPULATE_READ, which exists since Linux 5.14."""
_MAPPINGS: Final = Path("/proc/self/maps")
_SET_THP_DISABLE: Final = 41
"""Value of PR_SET_THP_DISABLE."""
_NO_ACCESS: Final = 0
"""Value of PROT_NONE. Such a mapping counts against the limit but takes no memory."""


class Granted(NamedTuple):
    """The real-time privileges that a process has been granted."""

    scheduling: bool
    """True if SCHED_FIFO is granted."""
    memory_lock: bool


def prepare_interpreter() -> None:
    """Prepare the interpreter for real time. Call it after all imports and before any thread is started.

    It switches the garbage collector off. The collector holds the interpreter, regardless of the thread in which it runs. Even
    with all present objects frozen, a collection took 0.04 to 0.7 ms. The collector is not needed: an hour of stops, runs and
    lost connections leaves no reference cycles, and the loop collects while it is not connected, when no cycle is due.
    """
    refuse_huge_pages()
    scheduling.set_time_slice(scheduling.SHORT_NS)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    gc.disable()


def refuse_huge_pages() -> None:
    """Disable huge pages for this process and all processes that it will start. A kernel without support ignores the call.

    Every ten seconds khugepaged merges small pages into huge pages in programs that have requested this, as numpy does for its
    arrays. During this time a kernel without preemption of its own code keeps all threads off that core, including the control
    thread and the delivery of the bus's bytes. Cycles began up to 23 ms late.
    """
    ctypes.CDLL(None).prctl(_SET_THP_DISABLE, 1, 0, 0, 0)


def schedule(priority: int) -> bool:
    """Request SCHED_FIFO for the calling thread and the threads that it will start. Return True if it is granted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        log.warning("no real-time scheduling (%s): cycles may be late on a busy computer", error.strerror)
        return False
    return True


def lock_memory() -> bool:
    """Lock every page that this process uses in memory, also future pages. Return True if it succeeded.

    Programs and libraries are read completely. Of other memory only touched pages are locked, because the first touch needs no disk, and
    thread stacks and reserved memory would take 300 MB.

    If a limit would make later allocations fail, no page stays locked.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) != 0:
        _not_locked(os.strerror(ctypes.get_errno()))
        return False
    _read_programs(libc)
    if not _beyond_limit():
        unlock_memory()
        _not_locked("the limit on locked memory leaves no room for more")
        return False
    return True


def _read_programs(libc: ctypes.CDLL) -> None:
    """Bring all pages of programs and libraries into memory. Older kernels cannot do this at once. They read each page at its first use."""
    for line in _MAPPINGS.read_text().splitlines():
        span, flags, *_, file = line.split(maxsplit=5)
        if flags.startswith("r") and file.startswith("/"):
            begin, end = (int(address, 16) for address in span.split("-"))
            libc.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _POPULATE_READ)


def unlock_memory() -> None:
    """Undo :func:`lock_memory`."""
    ctypes.CDLL(None).munlockall()


def _beyond_limit() -> bool:
    """Return True if memory beyond the limit can be locked. A process with the privilege has no limit."""
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if limit == resource.RLIM_INFINITY:
        return True
    try:
        mmap.mmap(-1, limit + mmap.PAGESIZE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=_NO_ACCESS).close()
    except OSError:
        return False
    return True


def _not_locked(why: str) -> None:
    log.warning("memory is not locked (%s): a cycle may wait for the disk when memory is short", why)
