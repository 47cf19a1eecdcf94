"""Real-time settings for the control thread. Each setting is tried, never inferred; a refused one is one line in the
log.

Scheduling belongs to a thread, the other settings to the process.
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
"""With Python's default of 5 ms, one busy sibling thread delays a 100 Hz thread by as much."""
CONTROL_PRIORITY: Final = 60
"""Above the 50 of the kernel's own interrupt threads."""
IO_PRIORITY: Final = 10
"""Below the control thread, above everything that is not real time: if a busy computer suspends a thread that holds the
interpreter's lock, the control thread waits as long (3 ms at p99 under load, measured).
"""
_MCL_CURRENT: Final = 1
_MCL_FUTURE: Final = 2
_MCL_ONFAULT: Final = 4
_POPULATE_READ: Final = 22
"""MADV_POPULATE_READ, since Linux 5.14."""
_MAPPINGS: Final = Path("/proc/self/maps")
_SET_THP_DISABLE: Final = 41
"""PR_SET_THP_DISABLE."""
_NO_ACCESS: Final = 0
"""PROT_NONE: such a mapping counts against the limit and takes no memory."""


class Granted(NamedTuple):
    """The real-time privileges that a process has been granted."""

    scheduling: bool
    """SCHED_FIFO."""
    memory_lock: bool


def prepare_interpreter() -> None:
    """Prepare the interpreter for real time. Call it after all imports and before any thread is started.

    It switches the garbage collector off. The collector holds the interpreter in whichever thread it runs: even with
    all present objects frozen, a collection took 0.04 to 0.7 ms. It is not needed: an hour of stops, runs and lost
    connections leaves no reference cycle behind, and the loop collects while it is not connected, when no cycle is due.
    """
    refuse_huge_pages()
    scheduling.set_time_slice(scheduling.SHORT_NS)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    gc.disable()


def refuse_huge_pages() -> None:
    """Refuse huge pages for this process and all that it will start. Without support in the kernel, nothing changes.

    Every ten seconds khugepaged merges small pages into huge ones where a program has requested them, as numpy does for
    its arrays. A kernel without preemption of its own code keeps all threads off that core meanwhile, including the
    control thread and the delivery of the bus's bytes: cycles began up to 23 ms late.
    """
    ctypes.CDLL(None).prctl(_SET_THP_DISABLE, 1, 0, 0, 0)


def schedule(priority: int) -> bool:
    """Ask for SCHED_FIFO for the calling thread, and for those it will start."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        log.warning("no real-time scheduling (%s): cycles may be late on a busy computer", error.strerror)
        return False
    return True


def lock_memory() -> bool:
    """Keep every page that this process uses in memory, also future ones.

    Programs and libraries are read completely. Of other memory only the pages that are touched are locked: the first touch needs no disk,
    and thread stacks and reserved memory would be 300 MB.

    All or nothing: if a limit would make later allocations fail, nothing stays locked.
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
    """Bring all pages of programs and libraries into memory. Older kernels cannot do so at once: the first use then reads them."""
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
    log.warning("memory is not locked (%s): a computer short of memory may make a cycle wait for its disk", why)
