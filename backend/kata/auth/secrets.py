"""Secrets that are given out once: of a sign-in's cookie, a link, a one-time code. Only their hash is ever kept.

Each has 150 bits or more by chance, so a plain SHA-256 cannot be searched backwards; passwords, which people choose, are
:mod:`kata.auth.passwords`' business.
"""

import hmac
import re
import secrets
from hashlib import sha256
from typing import Final

_LETTERS: Final = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
"""None that is mistaken for another when it is read out or copied from paper."""


def fresh() -> str:
    """256 bits, as they stand in a cookie or a link."""
    return secrets.token_urlsafe(32)


def fresh_code() -> str:
    """150 bits for somebody to type: six groups of five letters."""
    return "-".join("".join(secrets.choice(_LETTERS) for _ in range(5)) for _ in range(6))


def as_typed(code: str) -> str:
    """A code as it was given out, however it was typed: case, blanks and hyphens do not matter."""
    letters = re.sub(r"[\s-]", "", code).upper()
    return "-".join(letters[place : place + 5] for place in range(0, len(letters), 5))


def hashed(secret: str) -> str:
    """What is kept of it: SHA-256 in hexadecimal."""
    return sha256(secret.encode()).hexdigest()


def fits(secret: str, kept: str) -> bool:
    """Whether this is the secret of which ``kept`` is the hash; takes as long either way."""
    return hmac.compare_digest(hashed(secret), kept)
