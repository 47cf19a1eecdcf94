"""What keeps the control thread punctual. Everything is tried, nothing inferred; what is not granted is said in one line.

Scheduling belongs to a thread, the rest to the process.
"""

import ctypes
import gc
import logging
import mmap
import os
import resource
import sys
from typing import Final

from kata.system import scheduling

log = logging.getLogger(__name__)

_SWITCH_INTERVAL_S: Final = 50e-6
"""With Python's default of 5 ms, one busy sibling thread makes a 100 Hz thread that much late."""
CONTROL_PRIORITY: Final = 60
"""Above the 50 that the kernel gives its own interrupt threads."""
IO_PRIORITY: Final = 10
"""Below the control thread, above everything that is not real time: whoever holds the interpreter's lock and is put aside
by a busy computer makes the control thread wait for as long (3 ms at p99 under load, measured)."""
_MCL_CURRENT: Final = 1
_MCL_FUTURE: Final = 2
_SET_THP_DISABLE: Final = 41
"""PR_SET_THP_DISABLE."""
_NO_ACCESS: Final = 0
"""PROT_NONE: such a mapping counts against the limit and takes no memory."""


def settle() -> None:
    """Make Python itself quiet; call it with everything imported and before any thread is started.

    The collector is switched off, whichever thread it would run in: it holds the interpreter, and even with all that is
    there frozen a collection was measured to take 0.04 to 0.7 ms. It is not missed: an hour of stops, runs and lost
    connections leaves no reference cycle behind, and the loop collects while it is not connected, when no cycle is due.
    """
    refuse_huge_pages()
    scheduling.ask_for(scheduling.SHORT_NS)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    gc.disable()


def refuse_huge_pages() -> None:
    """For this process and all that it will start; where the kernel does not know of it, nothing changes.

    Every ten seconds khugepaged gathers small pages into huge ones where a program has asked for them, as numpy does for its
    arrays. A kernel that is not preempted within itself keeps everybody off that core meanwhile, the control thread and what
    brings the bus's bytes: cycles were measured to begin up to 23 ms late.
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
    """Keep every page of this process in memory, also those it will yet ask for.

    All or nothing: where a limit would make later allocations fail, nothing stays locked.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        _not_locked(os.strerror(ctypes.get_errno()))
        return False
    if not _beyond_limit():
        unlock_memory()
        _not_locked("the limit on locked memory leaves no room for more")
        return False
    return True


def unlock_memory() -> None:
    """Undo :func:`lock_memory`."""
    ctypes.CDLL(None).munlockall()


def _beyond_limit() -> bool:
    """With memory locked: whether more may be had than the limit says. Who has the privilege is not asked for less."""
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
