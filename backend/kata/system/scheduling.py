"""Sets time slices: how long a thread may use the processor while other threads wait, with ordinary scheduling.

A kernel thread of ordinary priority delivers the bytes of a serial port or pseudo-terminal. Every reader waits for that
thread, regardless of its own priority. When it wakes, it preempts at once only threads with longer slices than its own
(EEVDF, Linux 6.12; older kernels ignore the setting). It preempts other threads after their slice, which many kernels
check every 4 ms. All of Kata therefore requests long slices, except the parts that must be punctual. With 100 pages
open and plots drawn, 58 of 14,600 waits of that thread were longer than 1 ms (before: 346 of 14,100), and one in a
hundred was longer than 0.6 ms (before: 1.9 ms).
"""

import ctypes
import os
import platform
from typing import Final

LONG_NS: Final = 5_000_000
"""A long slice; 0.7 to 2.8 ms are usual. With 12 ms, a thread that has just used more than its share would wait for a whole slice."""
SHORT_NS: Final = 100_000
"""The shortest slice that the kernel accepts."""
_SET_ATTRIBUTES: Final = {"x86_64": 314, "aarch64": 274, "armv7l": 380, "riscv64": 274}
"""Number of the system call sched_setattr, by machine. C libraries have no function for it yet."""
_KEEP_POLICY: Final = 0x08
"""Value of SCHED_FLAG_KEEP_POLICY."""


class _Attributes(ctypes.Structure):
    """struct sched_attr in its first version."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )


def set_time_slice(ns: int) -> None:
    """Set the time slice of the calling thread and of the threads and processes that it will start. A kernel without support
    ignores the call.
    """
    call = _SET_ATTRIBUTES.get(platform.machine())
    if call is None:
        return
    attributes = _Attributes(
        size=ctypes.sizeof(_Attributes), flags=_KEEP_POLICY, nice=os.getpriority(os.PRIO_PROCESS, 0), runtime=ns
    )
    ctypes.CDLL(None).syscall(call, 0, ctypes.byref(attributes), 0)
