"""The key that opens backups (age, X25519), and who else's key does.

It is made at the first start beside the data, so that nobody has backups that nobody can read for want of a decision. It protects them
where they are kept, not on this computer, and burns with it: a copy of it has to be kept elsewhere. Its secret half may
be taken away from here altogether; the public half stays, and backups go on being made, but can no longer be tried here.
"""

import os
from pathlib import Path
from typing import Final, Literal

from pyrage import IdentityError, RecipientError
from pyrage.x25519 import Identity, Recipient

from kata.database.base import utc_now
from kata.settings import Settings

_TEXT: Final = """\
# The key of this clinic's backups, made {day}. Without it nobody can read a backup, the makers of Kata included.
# Keep a copy of this file away from this computer: printed, or on a stick in a safe. Whoever has it can read every backup.
# public key: {public}
{secret}
"""


class BackupError(Exception):
    """No backup can be made, or none can be restored; the message says why and what to do."""


def make_key(settings: Settings) -> bool:
    """Make the key where there is neither half of one; whether that was so.

    :raises BackupError: when it cannot be written.
    """
    secret, public = settings.backup_key_file, public_half(settings)
    if secret.exists() or public.exists():
        return False
    made = Identity.generate()
    told = _TEXT.format(day=utc_now().date(), public=made.to_public(), secret=made)
    try:
        secret.parent.mkdir(parents=True, exist_ok=True)
        _write(secret, told)
        _write(public, f"{made.to_public()}\n")
    except FileExistsError:
        # Somebody else, at the same moment.
        return False
    except OSError as error:
        raise BackupError(f"the key of the backups cannot be kept in {secret}: {error.strerror}") from error
    return True


def adopt_key(settings: Settings, key: Path) -> bool:
    """Go on with the key that has opened a backup, where there is none here; whether that was so."""
    secret, public = settings.backup_key_file, public_half(settings)
    if secret.exists() or public.exists():
        return False
    found = identities(key)
    secret.parent.mkdir(parents=True, exist_ok=True)
    _write(secret, key.read_text())
    _write(public, f"{found[0].to_public()}\n")
    return True


def whereabouts(settings: Settings) -> Literal["here", "elsewhere", "nowhere"]:
    """Of the key's secret half; nowhere: none has been made."""
    if settings.backup_key_file.exists():
        return "here"
    return "elsewhere" if public_half(settings).exists() else "nowhere"


def public_half(settings: Settings) -> Path:
    """The file beside the data that says for whom backups are encrypted."""
    return settings.data / "backup-key.pub"


def recipients(settings: Settings) -> list[Recipient]:
    """For whom backups are encrypted: the clinic's key, and everybody whom the settings name.

    :raises BackupError: when one of them is no public key of age.
    """
    told = [one.strip() for one in settings.backup_recipients.split(",") if one.strip()]
    if settings.backup_key_file.exists():
        ours = [identity.to_public() for identity in identities(settings.backup_key_file)]
    else:
        ours = [_recipient(line, public_half(settings)) for line in _lines(public_half(settings))]
    return [*ours, *(_recipient(one, "KATA_BACKUP_RECIPIENTS") for one in told)]


def identities(file: Path) -> list[Identity]:
    """The keys in a file as age-keygen writes it.

    :raises BackupError: when it cannot be read, or holds something else.
    """
    try:
        found = [Identity.from_str(line) for line in _lines(file)]
    except IdentityError as error:
        raise BackupError(
            f"{file} is no key of backups: its last line begins with AGE-SECRET-KEY-1, and every letter of it counts"
        ) from error
    if not found:
        raise BackupError(f"{file} holds no key; a key is a line that begins with AGE-SECRET-KEY-1")
    return found


def _lines(file: Path) -> list[str]:
    try:
        lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
    except OSError as error:
        raise BackupError(
            f"the key {file} cannot be read ({error.strerror}); name the copy that was kept elsewhere with --key"
        ) from error
    except UnicodeDecodeError as error:
        raise BackupError(f"{file} is no key of backups, but something else") from error
    return [line for line in lines if line and not line.startswith("#")]


def _recipient(text: str, where: Path | str) -> Recipient:
    try:
        return Recipient.from_str(text)
    except RecipientError as error:
        raise BackupError(f"{where} names {text!r}, which is no public key of age (age1...)") from error


def _write(file: Path, text: str) -> None:
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as opened:
        opened.write(text)
        opened.flush()
        os.fsync(opened.fileno())
