"""Excludes objects that exist until the process ends from garbage collection."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def permanent_objects() -> Iterator[None]:
    """Disable the collector while the context makes permanent objects, and freeze all objects at its end.

    Large imports and the routes of the service are hundreds of thousands of objects. The collector would scan them repeatedly while they
    are made, during the work of the service, and once more at the end. That takes most of a second and finds no garbage.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
