"""Memory that the service needs for a moment only."""

import subprocess
import sys

import pytest

from kata import memory

_GIVES_BACK = """
import ctypes
import sys
import threading
from kata import memory

class Allocated(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()]

libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]
libc.mallinfo2.restype = Allocated
libc.fdopen.restype = ctypes.c_void_p
libc.malloc_info.argtypes = [ctypes.c_int, ctypes.c_void_p]
libc.fflush.argtypes = [ctypes.c_void_p]
if sys.argv[1] == "asked":
    memory.give_back()

libc.free(libc.malloc(16 << 20))
before = libc.mallinfo2().hblks
libc.malloc(1 << 20)
print(libc.mallinfo2().hblks - before, flush=True)

together = threading.Barrier(6)
def allocate():
    together.wait()
    libc.malloc(100_000)
    together.wait()
threads = [threading.Thread(target=allocate) for _ in range(6)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
output = libc.fdopen(1, b"w")
libc.malloc_info(0, output)
libc.fflush(output)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the GNU C library's allocator")
@pytest.mark.parametrize(("asked", "mappings", "arenas"), [("asked", 1, memory.ARENAS), ("not", 0, 7)])
def test_a_large_block_is_gone_when_it_is_freed_and_threads_share_arenas(
    asked: str, mappings: int, arenas: int
) -> None:
    command = [sys.executable, "-c", _GIVES_BACK, asked]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert int(lines[0]) == mappings
    assert sum(line.startswith("<heap nr=") for line in lines) == arenas
