"""Signs commissioning records with the station's key (Ed25519), which never leaves the folder of the station's file.

A person who can change the database, or who gets a copy of a record, cannot sign a changed one. A person who can read the key can.
"""

from pathlib import Path

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, load_pem_private_key

from kata.system.files import write_private_file


class KeyFileError(Exception):
    """The file of a station's key cannot be used. The message says why."""


def load_key(file: Path) -> Ed25519PrivateKey | None:
    """Return the key in a file; None if there is no file.

    :raises KeyFileError: when the file cannot be read, or contains no such key.
    """
    try:
        key = load_pem_private_key(file.read_bytes(), password=None)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise KeyFileError(f"the station's key {file} cannot be read: {error.strerror}") from error
    except (ValueError, TypeError) as error:
        raise KeyFileError(f"the station's key {file} is damaged") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise KeyFileError(f"the station's key {file} is not a key for Ed25519")
    return key


def store_key(key: Ed25519PrivateKey, file: Path) -> None:
    """Write a key to a file that only this user can read."""
    pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    write_private_file(file, pem)


def public_key_of(key: Ed25519PrivateKey) -> str:
    """Return the public part of a key in hexadecimal."""
    return key.public_key().public_bytes_raw().hex()


def sign(key: Ed25519PrivateKey, digest: str) -> str:
    """Return the signature of a digest in hexadecimal."""
    return key.sign(digest.encode()).hex()


def is_signature(public_key: str, signature: str, digest: str) -> bool:
    """Return True if the owner of the key has signed the digest."""
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(public_key)).verify(bytes.fromhex(signature), digest.encode())
    except (InvalidSignature, ValueError):
        return False
    return True
