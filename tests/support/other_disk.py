"""A folder on another disk than the data of a test."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.paths import ROOT


@contextmanager
def other_disk(folder: Path) -> Iterator[Path]:
    """Create a temporary folder that is not on the disk of ``folder``: in memory, or in the checkout."""
    cache = ROOT / ".cache"
    cache.mkdir(exist_ok=True)
    disk = next(place for place in (Path("/dev/shm"), cache) if place.stat().st_dev != folder.stat().st_dev)
    with TemporaryDirectory(dir=disk) as made:
        yield Path(made)
