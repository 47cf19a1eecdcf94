"""What this user is granted on this computer, tried in the way the device process does, and undone."""

import platform
import threading

from kata.system import realtime


def fifo_granted() -> bool:
    """Tried in a thread that ends right afterwards: scheduling belongs to a thread."""
    tried: list[bool] = []
    trying = threading.Thread(target=lambda: tried.append(realtime.schedule(realtime.CONTROL_PRIORITY)))
    trying.start()
    trying.join()
    return tried == [True]


def memory_lock_granted() -> bool:
    """Tried, and undone."""
    granted = realtime.lock_memory()
    if granted:
        realtime.unlock_memory()
    return granted


def kernel_preemption() -> str:
    """PREEMPT_RT, PREEMPT_DYNAMIC, ... as the kernel names itself; empty when it does not."""
    return next((word for word in platform.version().split() if word.startswith("PREEMPT")), "")
