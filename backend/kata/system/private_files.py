"""Makes the service's files unreadable for other users of the computer, because they contain patients' data and keys."""

import os
import stat
from pathlib import Path
from typing import Final

UMASK: Final = 0o077
"""File mode creation mask. New files and folders have no permissions for the group and for others."""


def make_private(folder: Path) -> list[Path]:
    """Remove the permissions of group and others from a folder and everything in it. Symbolic links are not followed.

    :return: the changed paths.
    :raises OSError: when a file belongs to another user.
    """
    changed = []
    for parent, _, names in os.walk(folder):
        for path in (Path(parent), *(Path(parent, name) for name in names)):
            mode = path.lstat().st_mode
            if mode & UMASK and (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                path.chmod(stat.S_IMODE(mode) & ~UMASK)
                changed.append(path)
    return changed
