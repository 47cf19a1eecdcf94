"""What is imported stays until the end: nobody needs to look through it for garbage."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def staying() -> Iterator[None]:
    """Around imports of much: hundreds of thousands of objects, which the collector goes through again and again while they are made,
    in between while others wait, and once more at the end of the process. That is most of a second, and none of it is garbage.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
