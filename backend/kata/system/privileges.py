"""Tests the privileges of this user on this computer as the device process does, and undoes the test."""

import platform
import threading

from kata.system import realtime


def fifo_granted() -> bool:
    """Return True if SCHED_FIFO is granted. A short-lived thread tests it, because scheduling is a property of a thread."""
    tried: list[bool] = []
    trying = threading.Thread(target=lambda: tried.append(realtime.schedule(realtime.CONTROL_PRIORITY)))
    trying.start()
    trying.join()
    return tried == [True]


def memory_lock_granted() -> bool:
    """Return True if locked memory is granted. The lock is undone."""
    granted = realtime.lock_memory()
    if granted:
        realtime.unlock_memory()
    return granted


def kernel_preemption() -> str:
    """Return the kernel's preemption model (PREEMPT_RT, PREEMPT_DYNAMIC, ...) from its version text; empty if it is missing."""
    return next((word for word in platform.version().split() if word.startswith("PREEMPT")), "")
