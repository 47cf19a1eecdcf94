"""Writes files so that no reader finds a part of one."""

from pathlib import Path


def replace_file(path: Path, data: bytes) -> None:
    """Replace a file as a whole, by a new one beside it.

    :raises OSError: when it cannot be written; the former file is unchanged.
    """
    temporary = path.with_suffix(".writing")
    temporary.write_bytes(data)
    temporary.replace(path)
