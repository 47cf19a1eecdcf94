"""Find PostgreSQL's own programs on this computer."""

import shutil
from pathlib import Path
from typing import Final

_DEBIAN_FOLDER: Final = Path("/usr/lib/postgresql")


def postgresql_program(name: str) -> Path | None:
    """Return the path of a program such as ``pg_dump``, from PATH or else Debian's newest version. Return None if it is not installed."""
    path = shutil.which(name)
    candidates = [Path(path)] if path else sorted(_DEBIAN_FOLDER.glob(f"*/bin/{name}"), key=_version, reverse=True)
    return next(iter(candidates), None)


def _version(program: Path) -> float:
    try:
        return float(program.parents[1].name)
    except ValueError:
        return 0.0
