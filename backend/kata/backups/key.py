"""The key that opens backups (age, X25519), and further public keys for which backups are encrypted.

The first start creates the key beside the data, so that every installation has encrypted backups. The key protects backups that are stored
elsewhere; on this computer it protects nothing. It is lost with this computer, so keep a copy elsewhere. The secret key may be removed from
this computer: with only the public key, backups can still be made but not verified here.
"""

import os
from pathlib import Path
from typing import Final, Literal

from pyrage import IdentityError, RecipientError
from pyrage.x25519 import Identity, Recipient

from kata.database.base import utc_now
from kata.settings import Settings

_KEY_FILE_TEMPLATE: Final = """\
# The key of this clinic's backups, made {day}. Without it a backup cannot be read, not even by the makers of Kata.
# Store a copy of this file outside this computer: printed, or on a stick in a safe. Anyone with the key can read every backup.
# public key: {public}
{secret}
"""


class BackupError(Exception):
    """A backup cannot be made or restored. The message says why and what to do."""


def make_key(settings: Settings) -> bool:
    """Create the key unless a secret or public key exists. Return whether it was created.

    :raises BackupError: when it cannot be written.
    """
    secret, public = settings.backup_key_file, public_key_file(settings)
    if secret.exists() or public.exists():
        return False
    key = Identity.generate()
    try:
        secret.parent.mkdir(parents=True, exist_ok=True)
        _write_private(secret, _KEY_FILE_TEMPLATE.format(day=utc_now().date(), public=key.to_public(), secret=key))
        _write_private(public, f"{key.to_public()}\n")
    except FileExistsError:
        # Another process created the key at the same moment.
        return False
    except OSError as error:
        raise BackupError(f"the backup key cannot be written to {secret}: {error.strerror}") from error
    return True


def adopt_key(settings: Settings, key: Path) -> bool:
    """Copy the key that has opened a backup to this computer, unless the computer has a key. Return whether it was copied."""
    secret, public = settings.backup_key_file, public_key_file(settings)
    if secret.exists() or public.exists():
        return False
    secret_keys = identities(key)
    secret.parent.mkdir(parents=True, exist_ok=True)
    _write_private(secret, key.read_text())
    _write_private(public, f"{secret_keys[0].to_public()}\n")
    return True


def key_location(settings: Settings) -> Literal["here", "elsewhere", "nowhere"]:
    """Return where the secret key is. ``nowhere``: no key has been created."""
    if settings.backup_key_file.exists():
        return "here"
    return "elsewhere" if public_key_file(settings).exists() else "nowhere"


def public_key_file(settings: Settings) -> Path:
    """Return the file in the data folder with the public key for which backups are encrypted."""
    return settings.data / "backup-key.pub"


def recipients(settings: Settings) -> list[Recipient]:
    """Return the public keys for which backups are encrypted: the clinic's, and those of the settings.

    :raises BackupError: when one of them is not a public key of age.
    """
    additional = [key.strip() for key in settings.backup_recipients.split(",") if key.strip()]
    if settings.backup_key_file.exists():
        ours = [identity.to_public() for identity in identities(settings.backup_key_file)]
    else:
        ours = [_parse_recipient(line, public_key_file(settings)) for line in _read_lines(public_key_file(settings))]
    return [*ours, *(_parse_recipient(key, "KATA_BACKUP_RECIPIENTS") for key in additional)]


def identities(file: Path) -> list[Identity]:
    """Return the secret keys in a file of age-keygen's format.

    :raises BackupError: when the file cannot be read or contains no key.
    """
    try:
        secret_keys = [Identity.from_str(line) for line in _read_lines(file)]
    except IdentityError as error:
        raise BackupError(
            f"{file} is not a backup key: its last line must be a complete key that begins with AGE-SECRET-KEY-1"
        ) from error
    if not secret_keys:
        raise BackupError(f"{file} contains no key; a key is a line that begins with AGE-SECRET-KEY-1")
    return secret_keys


def _read_lines(file: Path) -> list[str]:
    try:
        lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
    except OSError as error:
        raise BackupError(f"the key {file} cannot be read ({error.strerror}); give a copy of it with --key") from error
    except UnicodeDecodeError as error:
        raise BackupError(f"{file} is not a backup key") from error
    return [line for line in lines if line and not line.startswith("#")]


def _parse_recipient(text: str, source: Path | str) -> Recipient:
    try:
        return Recipient.from_str(text)
    except RecipientError as error:
        raise BackupError(f"{source} contains {text!r}, which is not a public key of age (age1...)") from error


def _write_private(file: Path, text: str) -> None:
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as opened:
        opened.write(text)
        opened.flush()
        os.fsync(opened.fileno())
