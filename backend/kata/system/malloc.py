"""Settings of the C library's allocator that return free memory to the system.

Importing a playback into the database, or a plot, needs megabytes for a moment, in any thread. By default each thread
gets an arena of its own, up to eight a core, and the size from which a block is a separate mapping grows with the freed
blocks. Such megabytes then stay in the process, fragmented: after five minutes of short playbacks 13.5 MB and growing;
with these settings 1 to 2 MB.
"""

import ctypes
from typing import Final

LARGE_BYTES: Final = 256 << 10
"""A block of at least this size is a separate mapping, which is returned when it is freed. The same amount of free
memory at an arena's end is returned too.
"""
ARENAS: Final = 2
"""Limits the arenas. Only one thread at a time runs Python, and most blocks come from each thread's cache, not from an
arena.
"""
_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3
_ARENA_MAX: Final = -8


def return_free_memory() -> None:
    """Apply the settings to this process, before it has threads. Do not use it in a process with locked memory. Without
    such settings in the C library, nothing changes.
    """
    choose = getattr(ctypes.CDLL(None), "mallopt", None)
    if choose:
        for setting, value in ((_TRIM_THRESHOLD, LARGE_BYTES), (_MMAP_THRESHOLD, LARGE_BYTES), (_ARENA_MAX, ARENAS)):
            choose(setting, value)
