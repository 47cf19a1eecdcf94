"""How long somebody may keep the processor while others wait for it, asked of the kernel for ordinary scheduling.

Bytes pass through a serial port, as through a pseudo-terminal, by the hand of a kernel thread of ordinary priority, and whoever waits
for them waits for that thread, with whatever priority of its own. Woken, it takes the processor at once only from those whose turns
are longer than its own (EEVDF, Linux 6.12; older kernels do not know it and change nothing); from all others after their turn, and
that is looked at with the clock's tick, every 4 ms in many kernels. So all of Kata asks for long turns, but for what has to be in
time. With 100 pages open and plots drawn, 58 of 14,600 waits of that thread were longer than 1 ms, of 14,100 before 346, and one
in a hundred longer than 0.6 ms, before than 1.9 ms.
"""

import ctypes
import os
import platform
from typing import Final

LONG_NS: Final = 5_000_000
"""Usual are 0.7 to 2.8 ms. With 12 ms, who has just had more than its share waits for a whole one."""
SHORT_NS: Final = 100_000
"""The shortest that the kernel takes."""
_SET_ATTRIBUTES: Final = {"x86_64": 314, "aarch64": 274, "armv7l": 380, "riscv64": 274}
"""sched_setattr, by machine; C libraries have no function for it yet."""
_KEEP_POLICY: Final = 0x08
"""SCHED_FLAG_KEEP_POLICY."""


class _Attributes(ctypes.Structure):
    """struct sched_attr, as of its first version."""

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


def ask_for(ns: int) -> None:
    """For the calling thread, and for the threads and processes that it will start. Where it is not to be had, nothing changes."""
    call = _SET_ATTRIBUTES.get(platform.machine())
    if call is None:
        return
    attributes = _Attributes(
        size=ctypes.sizeof(_Attributes), flags=_KEEP_POLICY, nice=os.getpriority(os.PRIO_PROCESS, 0), runtime=ns
    )
    ctypes.CDLL(None).syscall(call, 0, ctypes.byref(attributes), 0)
