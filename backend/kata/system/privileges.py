"""The privileges of this user on this computer, tested in the same way as in the device process, and undone."""

import platform
import threading

from kata.system import realtime


def fifo_granted() -> bool:
    """Return True if SCHED_FIFO is granted. A short-lived thread tests it, because scheduling belongs to a thread."""
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
    """Return PREEMPT_RT, PREEMPT_DYNAMIC, ... as the kernel names itself; empty if it does not."""
    return next((word for word in platform.version().split() if word.startswith("PREEMPT")), "")
