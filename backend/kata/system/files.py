"""Writes files atomically, so that a reader never finds an incomplete file."""

from pathlib import Path


def replace_file(path: Path, data: bytes) -> None:
    """Replace a file atomically, with a new file that is written beside it.

    :raises OSError: when the file cannot be written. The former file is then unchanged.
    """
    temporary = path.with_suffix(".writing")
    temporary.write_bytes(data)
    temporary.replace(path)
