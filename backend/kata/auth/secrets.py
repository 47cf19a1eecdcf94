"""Random secrets for cookies, links and one-time codes. Only their hashes are stored.

Each secret has at least 150 random bits, so a plain SHA-256 is safe. For passwords, see :mod:`kata.auth.passwords`.
"""

import hmac
import re
import secrets
from hashlib import sha256
from typing import Final

_ALPHABET: Final = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
"""Characters that people do not confuse with each other."""


def new_secret() -> str:
    """Return a secret of 256 bits for a cookie or a link."""
    return secrets.token_urlsafe(32)


def new_code() -> str:
    """Return a code of 150 bits that people can type: six groups of five characters."""
    return "-".join("".join(secrets.choice(_ALPHABET) for _ in range(5)) for _ in range(6))


def normalize_code(code: str) -> str:
    """Return a typed code in its original form. Case, blanks and hyphens make no difference."""
    letters = re.sub(r"[\s-]", "", code).upper()
    return "-".join(letters[place : place + 5] for place in range(0, len(letters), 5))


def hash_secret(secret: str) -> str:
    """Return the SHA-256 of a secret in hexadecimal."""
    return sha256(secret.encode()).hexdigest()


def matches(secret: str, stored_hash: str) -> bool:
    """Return whether a secret has this hash, in constant time."""
    return hmac.compare_digest(hash_secret(secret), stored_hash)
