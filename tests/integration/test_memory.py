"""The service returns memory that it needs for a short time only."""

import subprocess
import sys
from pathlib import Path

import pytest

from kata.system import malloc

_GIVES_BACK = """
import ctypes
import socket
import sys
import threading
from contextlib import suppress
from pathlib import Path
from kata.system import malloc

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
    malloc.return_free_memory()
if sys.argv[1] == "served":
    from kata.cli import serve
    from kata.settings import Settings
    # It has nowhere to listen, and so ends at once.
    with socket.create_server(("127.0.0.1", 0)) as taken, suppress(SystemExit):
        served = Settings(simulate=True, data=Path(sys.argv[2]), port=taken.getsockname()[1])
        serve.serve(served, reload=False)

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


pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the GNU C library's allocator")


def lines(folder: Path, how: str) -> list[str]:
    """Return how many mappings a block adds after a larger one was freed, then a list that contains the arenas."""
    command = [sys.executable, "-c", _GIVES_BACK, how, str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.mark.parametrize(
    ("how", "mappings", "arenas"), [("asked", 1, malloc.ARENAS), pytest.param("not", 0, 7, marks=pytest.mark.campaign)]
)
def test_freed_large_block_is_returned_and_threads_share_arenas(
    tmp_path: Path, how: str, mappings: int, arenas: int
) -> None:
    printed = lines(tmp_path, how)
    assert int(printed[0]) == mappings
    assert sum(line.startswith("<heap nr=") for line in printed) == arenas


def test_service_limits_its_memory_arenas(tmp_path: Path) -> None:
    assert int(lines(tmp_path, "served")[0]) == 1
