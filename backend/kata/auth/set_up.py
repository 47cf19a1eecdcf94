"""The way in for a clinic without administrators, or locked out: a one-time link, whose hash is a file of the data folder.

A file, because the service alone writes to a SQLite database: the command that makes a new link needs neither. Whoever can
write to the data folder can read everything in it anyway.
"""

import json
import os
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from kata.auth import secrets

_FILE: Final = "set-up-link.json"
LASTS: Final = timedelta(hours=24)


def offer(folder: Path, now: datetime) -> str:
    """A new link's secret; one that was offered before is good no longer.

    :raises OSError: when nothing can be written there.
    """
    secret = secrets.fresh()
    told = json.dumps({"hash": secrets.hashed(secret), "until": (now + LASTS).isoformat()})
    folder.mkdir(parents=True, exist_ok=True)
    beside = folder / f"{_FILE}.new"
    beside.unlink(missing_ok=True)
    with os.fdopen(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(told)
    beside.replace(folder / _FILE)
    return secret


def invitation(url: str, secret: str) -> str:
    """What whoever sets the clinic up is told, on the terminal and never in the log: who reads it is let in."""
    return f"Set up the clinic's administrator, once, within {LASTS.total_seconds() / 3600:g} hours: {url}/set-up#secret={secret}"


def fits(folder: Path, secret: str, now: datetime) -> bool:
    """Whether this link is the one on offer."""
    try:
        told = json.loads((folder / _FILE).read_text())
        return secrets.fits(secret, told["hash"]) and now < datetime.fromisoformat(told["until"])
    except (OSError, ValueError, KeyError, TypeError):
        return False


def used_up(folder: Path) -> bool:
    """Take the offer away; False where somebody else has been faster."""
    try:
        (folder / _FILE).unlink()
    except FileNotFoundError:
        return False
    return True
