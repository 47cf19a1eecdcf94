"""Empty databases of the current schema, copied from one upgraded file: migrations have their own tests."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from kata.database.engine import Database
from kata.database.upgrade import upgrade


def upgraded_file(file: Path) -> str:
    """Create an empty database at this path and return its URL."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(_upgraded())
    return f"sqlite:///{file}"


@cache
def _upgraded() -> bytes:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "kata.db"
        made = Database(f"sqlite:///{file}")
        upgrade(made)
        made.close()
        return file.read_bytes()
