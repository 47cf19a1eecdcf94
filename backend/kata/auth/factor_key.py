"""The key that the second factors' secrets are sealed with: a file outside the database, so that whoever reads the one has no codes.

Made at the first start. Services that share a database share it. A secret is bound to its account: put into another one's row,
it does not open. When the key is lost, so are the secrets: recovery codes go on working, and an administrator resets the others.
"""

import os
from base64 import urlsafe_b64decode, urlsafe_b64encode
from contextlib import suppress
from pathlib import Path
from typing import Final
from uuid import UUID

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from kata.database.base import utc_now

_BITS: Final = 256
_NONCE_BYTES: Final = 12
_TEXT: Final = """\
# The key that second factors are sealed with in this clinic's database, made {day}. Every service on that database needs it.
# The first line seals; all of them open. Without it everybody's second factor has to be set up anew.
{key}
"""


class FactorKeyError(Exception):
    """The key cannot be made or used; the message says why and what to do."""


class FactorKey:
    """Seals and opens (AES-256-GCM)."""

    def __init__(self, *keys: bytes) -> None:
        """``keys``: 32 bytes each; the first seals, all open. Without any, one that is forgotten with this object.

        :raises ValueError: when one has another length.
        """
        self._keys = [AESGCM(key) for key in keys or (AESGCM.generate_key(_BITS),)]

    def close(self, secret: str, account_id: UUID) -> str:
        """As it is kept with this account."""
        nonce = os.urandom(_NONCE_BYTES)
        sealed = self._keys[0].encrypt(nonce, secret.encode(), account_id.bytes)
        return urlsafe_b64encode(nonce + sealed).decode()

    def open(self, sealed: str, account_id: UUID) -> str | None:
        """The secret; None where it was sealed with another key, for another account, or was changed."""
        try:
            packed = urlsafe_b64decode(sealed)
        except ValueError:
            return None
        for key in self._keys:
            try:
                return key.decrypt(packed[:_NONCE_BYTES], packed[_NONCE_BYTES:], account_id.bytes).decode()
            except (InvalidTag, ValueError):
                continue
        return None


def factor_key(file: Path) -> FactorKey:
    """The one in this file, which is made where there is none.

    :raises FactorKeyError: when it cannot be written or read, when others can read it, or when it holds something else.
    """
    try:
        # Somebody else, at the same moment.
        with suppress(FileExistsError):
            _make(file)
        if file.stat().st_mode & 0o007:
            raise FactorKeyError(
                f"Others on this computer can read {file}, the key of the second factors: chmod 600 {file}"
            )
        lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
        keys = [urlsafe_b64decode(line) for line in lines if line and not line.startswith("#")]
        if not keys or any(len(key) * 8 != _BITS for key in keys):
            raise ValueError
    except OSError as error:
        raise FactorKeyError(f"The key of the second factors, {file}, cannot be used: {error.strerror}.") from error
    except ValueError as error:
        raise FactorKeyError(
            f"{file} holds no key of second factors. Put the right one there, from a backup or from another service on this database; "
            "without it, move the file away: a new key is made, and everybody's second factor has to be reset."
        ) from error
    return FactorKey(*keys)


def adopt(file: Path, other: Path) -> None:
    """From now on ``file`` opens what ``other``, which came out of a backup, opens; what it seals with stays.

    :raises OSError: when it cannot be written.
    """
    if not file.exists():
        _write(file, other.read_text(encoding="utf-8"))
        return
    there = file.read_text(encoding="utf-8")
    missing = [line for line in other.read_text(encoding="utf-8").splitlines() if line not in there]
    if missing:
        part = file.with_name(f"{file.name}.adopted")
        part.unlink(missing_ok=True)
        _write(part, "\n".join([there.rstrip("\n"), *missing, ""]))
        part.replace(file)


def _make(file: Path) -> None:
    if not file.exists():
        key = urlsafe_b64encode(AESGCM.generate_key(_BITS)).decode()
        _write(file, _TEXT.format(day=utc_now().date(), key=key))


def _write(file: Path, told: str) -> None:
    """A new file, for this user alone."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as opened:
            opened.write(told)
            opened.flush()
            os.fsync(opened.fileno())
        # Whole under its name, or not there; whoever else makes one at the same moment is not written over.
        os.link(part, file)
    finally:
        part.unlink(missing_ok=True)
