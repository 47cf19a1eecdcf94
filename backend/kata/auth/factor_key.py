"""The key that encrypts the secrets of second factors. It is a file outside the database, so that the database alone reveals no codes.

The first start creates the key. Services that share a database share the key. A secret is bound to its account and cannot be decrypted in
another row. If the key is lost, so are the secrets; recovery codes still work, and an administrator resets the second factors.
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
# The key that encrypts the second factors in this clinic's database, made {day}. Every service on that database needs this file.
# The first key encrypts; all keys decrypt. If the file is lost, every user must set up the second factor again.
{key}
"""


class FactorKeyError(Exception):
    """The key cannot be created or used. The message says why and what to do."""


class FactorKey:
    """Encrypts and decrypts secrets (AES-256-GCM)."""

    def __init__(self, *keys: bytes) -> None:
        """``keys``: 32 bytes each; the first encrypts, all decrypt. Without keys, a temporary key is created.

        :raises ValueError: when a key has another length.
        """
        self._keys = [AESGCM(key) for key in keys or (AESGCM.generate_key(_BITS),)]

    def encrypt(self, secret: str, account_id: UUID) -> str:
        """Return the secret in the form that is stored with the account."""
        nonce = os.urandom(_NONCE_BYTES)
        encrypted = self._keys[0].encrypt(nonce, secret.encode(), account_id.bytes)
        return urlsafe_b64encode(nonce + encrypted).decode()

    def decrypt(self, encrypted: str, account_id: UUID) -> str | None:
        """Return the secret, or None if it was encrypted with another key or for another account, or was changed."""
        try:
            packed = urlsafe_b64decode(encrypted)
        except ValueError:
            return None
        for key in self._keys:
            try:
                return key.decrypt(packed[:_NONCE_BYTES], packed[_NONCE_BYTES:], account_id.bytes).decode()
            except (InvalidTag, ValueError):
                continue
        return None


def read_factor_key(file: Path) -> FactorKey:
    """Return the key in this file. Create the file if it does not exist.

    :raises FactorKeyError: when the file cannot be written or read, other users can read it, or it contains no key.
    """
    try:
        # Another service may create the file at the same moment.
        with suppress(FileExistsError):
            _create_file(file)
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
            f"{file} contains no key of second factors. Restore the right one from a backup or from another service on this database. "
            "If it is lost, move the file away: Kata creates a new key, and all second factors must be reset."
        ) from error
    return FactorKey(*keys)


def add_keys(file: Path, other: Path) -> None:
    """Add the keys of ``other``, a file from a backup, to ``file``. The key that encrypts stays the same.

    :raises OSError: when the file cannot be written.
    """
    if not file.exists():
        _write(file, other.read_text(encoding="utf-8"))
        return
    present = file.read_text(encoding="utf-8")
    missing = [line for line in other.read_text(encoding="utf-8").splitlines() if line not in present]
    if missing:
        part = file.with_name(f"{file.name}.adopted")
        part.unlink(missing_ok=True)
        _write(part, "\n".join([present.rstrip("\n"), *missing, ""]))
        part.replace(file)


def _create_file(file: Path) -> None:
    if not file.exists():
        key = urlsafe_b64encode(AESGCM.generate_key(_BITS)).decode()
        _write(file, _TEXT.format(day=utc_now().date(), key=key))


def _write(file: Path, text: str) -> None:
    """Create a file that only this user can read.

    :raises FileExistsError: when the file exists.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as opened:
            opened.write(text)
            opened.flush()
            os.fsync(opened.fileno())
        # A link is atomic and, unlike a rename, never replaces a file that another process has just created.
        os.link(part, file)
    finally:
        part.unlink(missing_ok=True)
