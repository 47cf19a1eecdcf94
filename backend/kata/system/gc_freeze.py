"""Excludes imported objects from garbage collection, because they exist until the process ends."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def frozen_imports() -> Iterator[None]:
    """Disable the collector around large imports and freeze the imported objects.

    Large imports make hundreds of thousands of objects. The collector would scan them repeatedly during the imports, while
    other processes wait for this one, and once more at the end. That takes most of a second and finds no garbage.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
