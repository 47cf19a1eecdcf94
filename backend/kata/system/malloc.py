"""Sets the C library's allocator so that it returns free memory to the system.

Importing a playback into the database, or a plot, needs megabytes for a short time, in any thread. By default each thread gets
an arena of its own, up to eight for each core, and the size from which a block is a separate mapping grows with the freed
blocks. The freed memory then stays in the process, fragmented: 13.5 MB and growing after five minutes of short playbacks. With
these settings 1 to 2 MB stay.
"""

import ctypes
from typing import Final

LARGE_BYTES: Final = 256 << 10
"""A block of at least this size is a separate mapping, which is returned when it is freed. The same amount of free
memory at an arena's end is returned too.
"""
ARENAS: Final = 2
"""Maximum number of arenas. Only one thread at a time runs Python, and most blocks come from each thread's cache instead of an
arena.
"""
_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3
_ARENA_MAX: Final = -8


def return_free_memory() -> None:
    """Apply the settings to this process before it has threads. Do not use this in a process with locked memory. A C library
    without such settings ignores the call.
    """
    choose = getattr(ctypes.CDLL(None), "mallopt", None)
    if choose:
        for setting, value in ((_TRIM_THRESHOLD, LARGE_BYTES), (_MMAP_THRESHOLD, LARGE_BYTES), (_ARENA_MAX, ARENAS)):
            choose(setting, value)
