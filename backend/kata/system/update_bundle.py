"""Writes and reads signed bundles of a version: one file with all its wheels, for computers without the internet.

A bundle is a tar archive: the manifest (version, and SHA-256 of each wheel), its Ed25519 signature, then the wheels. No part of a bundle is
used before the signature and the hashes are verified.
"""

import argparse
import hashlib
import io
import re
import sys
import tarfile
from pathlib import Path
from typing import IO, Final

import msgspec
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import load_pem_private_key, load_pem_public_key

_MANIFEST: Final = "manifest.json"
_SIGNATURE: Final = "manifest.sig"
_VERSION: Final = re.compile(r"\d+\.\d+\.\d+")
_WHEEL: Final = re.compile(r"[A-Za-z0-9_.+-]+\.whl")
"""A file name without a folder."""
_LONGEST_MANIFEST: Final = 1 << 20
_SIGNATURE_BYTES: Final = 64
_CHUNK: Final = 1 << 20


class BundleError(Exception):
    """A file is not a bundle, or its signature is not valid. The message says which."""


class Manifest(msgspec.Struct, frozen=True, tag_field="format", tag="kata-update/1"):
    """The signed part of a bundle."""

    version: str
    wheels: dict[str, str]
    """SHA-256 of each wheel in hexadecimal, by file name."""

    def __post_init__(self) -> None:
        if not _VERSION.fullmatch(self.version):
            raise ValueError(f"{self.version} is not a version")
        if not self.wheels or not all(_WHEEL.fullmatch(name) for name in self.wheels):
            raise ValueError("the names of its wheels are invalid")


def write_bundle(out: Path, version: str, wheels: list[Path], key: Ed25519PrivateKey) -> None:
    """Write a bundle of these wheels. The same wheels and the same key give the same bytes.

    :raises ValueError: when the version or a wheel's name is invalid.
    """
    files = {wheel.name: wheel for wheel in sorted(wheels)}
    manifest = Manifest(version, {name: _sha256(file) for name, file in files.items()})
    encoded = msgspec.json.encode(manifest)
    with tarfile.open(out, "w", format=tarfile.PAX_FORMAT) as archive:
        for name, content in ((_MANIFEST, encoded), (_SIGNATURE, key.sign(encoded))):
            archive.addfile(_member(name, len(content)), io.BytesIO(content))
        for name, file in files.items():
            with file.open("rb") as opened:
                archive.addfile(_member(name, file.stat().st_size), opened)


def read_manifest(bundle: Path, public_key: Path) -> Manifest:
    """Return the manifest if its signature is valid. The wheels are not read yet.

    :raises BundleError: when the file is not a bundle, or another key has signed it.
    :raises OSError: when a file cannot be read.
    """
    with _opened(bundle) as archive:
        return _verified_manifest(archive, _public_key(public_key), bundle)


def unpack_bundle(bundle: Path, public_key: Path, folder: Path) -> list[Path]:
    """Copy the wheels into a folder. Return their paths. Each wheel is compared with the signed manifest.

    :raises BundleError: as :func:`read_manifest`, and when a wheel is missing or differs.
    :raises OSError: when a file cannot be read or written.
    """
    with _opened(bundle) as archive:
        manifest = _verified_manifest(archive, _public_key(public_key), bundle)
        unpacked = []
        for name, expected in manifest.wheels.items():
            target = folder / name
            with _member_file(archive, name, bundle) as source, target.open("wb") as copy:
                digest = hashlib.sha256()
                while chunk := source.read(_CHUNK):
                    digest.update(chunk)
                    copy.write(chunk)
            if digest.hexdigest() != expected:
                raise BundleError(f"{bundle} is damaged: {name} differs from the signed manifest.")
            unpacked.append(target)
    return unpacked


def _opened(bundle: Path) -> tarfile.TarFile:
    try:
        return tarfile.open(bundle, "r:")
    except tarfile.TarError as error:
        raise BundleError(f"{bundle} is not a bundle of Kata.") from error


def _verified_manifest(archive: tarfile.TarFile, key: Ed25519PublicKey, bundle: Path) -> Manifest:
    encoded = _content(archive, _MANIFEST, _LONGEST_MANIFEST, bundle)
    signature = _content(archive, _SIGNATURE, _SIGNATURE_BYTES, bundle)
    try:
        key.verify(signature, encoded)
    except InvalidSignature as error:
        raise BundleError(
            f"The signature of {bundle} is not valid: it was signed with another key, or it was changed."
        ) from error
    try:
        return msgspec.json.decode(encoded, type=Manifest)
    except msgspec.MsgspecError as error:
        raise BundleError(f"This version of Kata cannot read the manifest of {bundle}: {error}.") from error


def _content(archive: tarfile.TarFile, name: str, longest: int, bundle: Path) -> bytes:
    with _member_file(archive, name, bundle) as file:
        content = file.read(longest + 1)
    if len(content) > longest:
        raise BundleError(f"{bundle} is not a bundle of Kata: {name} is too long.")
    return content


def _member_file(archive: tarfile.TarFile, name: str, bundle: Path) -> IO[bytes]:
    try:
        member = archive.getmember(name)
        file = archive.extractfile(member) if member.isreg() else None
    except (KeyError, tarfile.TarError) as error:
        raise BundleError(f"{bundle} is not a bundle of Kata, or it is incomplete: {name} is missing.") from error
    if file is None:
        raise BundleError(f"{bundle} is not a bundle of Kata: {name} is not a file.")
    return file


def _public_key(file: Path) -> Ed25519PublicKey:
    try:
        key = load_pem_public_key(file.read_bytes())
    except (ValueError, UnsupportedAlgorithm) as error:
        raise BundleError(f"{file} is not a public key (PEM).") from error
    if not isinstance(key, Ed25519PublicKey):
        raise BundleError(f"{file} is not a public key for Ed25519.")
    return key


def _member(name: str, size: int) -> tarfile.TarInfo:
    member = tarfile.TarInfo(name)
    member.size = size
    return member


def _sha256(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def main() -> int:
    """Run ``python -m kata.system.update_bundle``, with which the maintainers sign a release. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m kata.system.update_bundle", description=main.__doc__)
    parser.add_argument(
        "--key", type=Path, required=True, help="private key, as of: openssl genpkey -algorithm ed25519"
    )
    parser.add_argument("--version", required=True, help="the version, such as 1.1.0")
    parser.add_argument("--out", type=Path, required=True, help="the bundle to write")
    parser.add_argument(
        "wheels", type=Path, nargs="+", help="the wheel of Kata and those of all packages that it needs"
    )
    arguments = parser.parse_args()
    key = load_pem_private_key(arguments.key.read_bytes(), password=None)
    if not isinstance(key, Ed25519PrivateKey):
        parser.error(f"{arguments.key} is not a private key for Ed25519")
    try:
        write_bundle(arguments.out, arguments.version, arguments.wheels, key)
    except ValueError as error:
        parser.error(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(main())
