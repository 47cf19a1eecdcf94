"""Random secrets of cookies, links and one-time codes. Only their hash is stored.

Each has at least 150 random bits, so a plain SHA-256 is safe. For passwords, see :mod:`kata.auth.passwords`.
"""

import hmac
import re
import secrets
from hashlib import sha256
from typing import Final

_ALPHABET: Final = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
"""Characters that are not confused with each other."""


def new_secret() -> str:
    """Return a secret of 256 bits for a cookie or a link."""
    return secrets.token_urlsafe(32)


def new_code() -> str:
    """Return a code of 150 bits for typing: six groups of five characters."""
    return "-".join("".join(secrets.choice(_ALPHABET) for _ in range(5)) for _ in range(6))


def normalize_code(code: str) -> str:
    """Return a typed code in its original form. Case, blanks and hyphens do not matter."""
    letters = re.sub(r"[\s-]", "", code).upper()
    return "-".join(letters[place : place + 5] for place in range(0, len(letters), 5))


def hash_secret(secret: str) -> str:
    """Return the SHA-256 of a secret in hexadecimal."""
    return sha256(secret.encode()).hexdigest()


def matches(secret: str, stored_hash: str) -> bool:
    """Return whether a secret has this hash, in constant time."""
    return hmac.compare_digest(hash_secret(secret), stored_hash)
