"""Permissions of files."""

import stat
from pathlib import Path


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def open_to_others(folder: Path) -> list[str]:
    """Return every file and folder in ``folder``, and itself, that the group or others may use."""
    paths = [path for path in (folder, *folder.rglob("*")) if not path.is_symlink()]
    return [f"{path}: {mode_of(path):o}" for path in paths if mode_of(path) & 0o077]
