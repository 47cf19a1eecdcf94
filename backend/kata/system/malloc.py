"""What the service asks of the C library's allocator: that what is free goes back to the computer.

For a playback that is brought into the database, or a plot, megabytes are needed for a moment, in whichever thread has the time. By
default each thread gets an arena of its own, up to eight a core, and the size from which a block is a mapping of its own grows with the
blocks that are freed; so such megabytes stay with the process, in pieces here and there: after five minutes of short playbacks 13.5 MB
of them and still growing, with this 1 to 2.
"""

import ctypes
from typing import Final

LARGE_BYTES: Final = 256 << 10
"""From here on a block is a mapping of its own, which is gone when it is freed; and so much that is free at an arena's end goes, too."""
ARENAS: Final = 2
"""One thread at a time runs Python, and most blocks come from each thread's cache before any arena is asked."""
_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3
_ARENA_MAX: Final = -8


def give_back() -> None:
    """For this process, before it has threads; not for one whose memory is locked, which has to keep what it has touched. Where the C
    library has no such settings, nothing changes.
    """
    choose = getattr(ctypes.CDLL(None), "mallopt", None)
    if choose:
        for setting, value in ((_TRIM_THRESHOLD, LARGE_BYTES), (_MMAP_THRESHOLD, LARGE_BYTES), (_ARENA_MAX, ARENAS)):
            choose(setting, value)
