"""The set-up link for a clinic that has no administrator or is locked out. A file in the data folder contains the hash of its secret.

The hash is in a file because only the service writes to a SQLite database, and another process creates the link. A user who can
write to the data folder can read all data anyway.
"""

import json
import os
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from kata.auth import secrets

_FILE: Final = "set-up-link.json"
SET_UP_LINK_VALIDITY: Final = timedelta(hours=24)


def offer(folder: Path, now: datetime) -> str:
    """Return the secret of a new link. An earlier link becomes invalid.

    :raises OSError: when the folder cannot be written to.
    """
    secret = secrets.new_secret()
    text = json.dumps({"hash": secrets.hash_secret(secret), "until": (now + SET_UP_LINK_VALIDITY).isoformat()})
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f"{_FILE}.new"
    part.unlink(missing_ok=True)
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(text)
    part.replace(folder / _FILE)
    return secret


def invitation(url: str, secret: str) -> str:
    """Return the text with the set-up link. Print it only on the terminal and never in the log, because the link is a secret."""
    return f"Set up the clinic's administrator. The link works once, within {SET_UP_LINK_VALIDITY.total_seconds() / 3600:g} hours: {url}/set-up#secret={secret}"


def is_valid(folder: Path, secret: str, now: datetime) -> bool:
    """Return whether this is the secret of the valid link."""
    try:
        offer = json.loads((folder / _FILE).read_text())
        return secrets.matches(secret, offer["hash"]) and now < datetime.fromisoformat(offer["until"])
    except (OSError, ValueError, KeyError, TypeError):
        return False


def use_up(folder: Path) -> bool:
    """Remove the link. Return False if another request has used it first."""
    try:
        (folder / _FILE).unlink()
    except FileNotFoundError:
        return False
    return True
