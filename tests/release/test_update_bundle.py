"""Signed bundles: reading and unpacking them, and refusing changed ones."""

import io
import tarfile
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat

from kata.system import update_bundle
from kata.system.update_bundle import BundleError, read_manifest, unpack_bundle, write_bundle

KEY = Ed25519PrivateKey.generate()


def public(folder: Path, key: Ed25519PrivateKey = KEY) -> Path:
    file = folder / "key.pem"
    file.write_bytes(key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo))
    return file


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    wheels = []
    for name in ("kata-1.1.0-py3-none-any.whl", "numpy-2.4.6-cp311-cp311-linux_x86_64.whl"):
        wheels.append(tmp_path / name)
        wheels[-1].write_bytes(name.encode() * 1000)
    write_bundle(tmp_path / "kata.bundle", "1.1.0", wheels, KEY)
    return tmp_path / "kata.bundle"


def changed(bundle: Path, name: str, content: bytes | None) -> Path:
    """Return a copy of the bundle with another content of one member; None leaves it out."""
    out = bundle.with_name("changed.bundle")
    with tarfile.open(bundle) as old, tarfile.open(out, "w") as new:
        for member in old.getmembers():
            file = old.extractfile(member)
            assert file
            data = content if member.name == name else file.read()
            if data is not None:
                member.size = len(data)
                new.addfile(member, io.BytesIO(data))
    return out


def test_a_signed_bundle_is_unpacked_as_it_was(bundle: Path, tmp_path: Path) -> None:
    assert read_manifest(bundle, public(tmp_path)).version == "1.1.0"
    target = tmp_path / "unpacked"
    target.mkdir()
    unpacked = unpack_bundle(bundle, public(tmp_path), target)
    assert [file.read_bytes() for file in unpacked] == [(tmp_path / file.name).read_bytes() for file in unpacked]
    assert len(unpacked) == 2


def test_a_wheel_with_a_long_name_is_bundled(tmp_path: Path) -> None:
    name = "charset_normalizer-3.5.2-cp311-cp311-manylinux2014_x86_64.manylinux_2_17_x86_64.manylinux_2_28_x86_64.whl"
    wheel = tmp_path / name
    wheel.write_bytes(b"numbers")
    write_bundle(tmp_path / "kata.bundle", "1.1.0", [wheel], KEY)
    target = tmp_path / "unpacked"
    target.mkdir()
    (unpacked,) = unpack_bundle(tmp_path / "kata.bundle", public(tmp_path), target)
    assert (unpacked.name, unpacked.read_bytes()) == (name, b"numbers")


def test_two_bundles_of_the_same_wheels_are_equal(bundle: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.bundle"
    write_bundle(again, "1.1.0", list(tmp_path.glob("*.whl")), KEY)
    assert again.read_bytes() == bundle.read_bytes()


def test_another_key_is_refused(bundle: Path, tmp_path: Path) -> None:
    with pytest.raises(BundleError, match="another key"):
        read_manifest(bundle, public(tmp_path, Ed25519PrivateKey.generate()))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("manifest.json", b'{"format":"kata-update/1","version":"9.9.9","wheels":{"a.whl":""}}', "not valid"),
        ("manifest.sig", b"\0" * 64, "not valid"),
        ("manifest.sig", b"\0" * 65, "too long"),
        ("manifest.json", None, "missing"),
        ("kata-1.1.0-py3-none-any.whl", b"another program", "differs"),
        ("kata-1.1.0-py3-none-any.whl", None, "missing"),
    ],
)
def test_a_changed_bundle_is_refused(
    bundle: Path, tmp_path: Path, name: str, content: bytes | None, message: str
) -> None:
    target = tmp_path / "unpacked"
    target.mkdir()
    with pytest.raises(BundleError, match=message):
        unpack_bundle(changed(bundle, name, content), public(tmp_path), target)


@pytest.mark.parametrize("cut", [0, 100, 600, 5000])
def test_a_cut_bundle_is_refused(bundle: Path, tmp_path: Path, cut: int) -> None:
    bundle.write_bytes(bundle.read_bytes()[:cut])
    with pytest.raises(BundleError):
        unpack_bundle(bundle, public(tmp_path), tmp_path)


@pytest.mark.parametrize("name", ["../kata.whl", "/etc/kata.whl", "a/b.whl", "kata.tar", ""])
def test_a_signed_name_outside_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    encoded = b'{"format":"kata-update/1","version":"1.1.0","wheels":{"%s":""}}' % name.encode()
    file = tmp_path / "kata.bundle"
    with tarfile.open(file, "w") as archive:
        for member, content in (("manifest.json", encoded), ("manifest.sig", KEY.sign(encoded))):
            info = tarfile.TarInfo(member)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    with pytest.raises(BundleError, match="invalid"):
        read_manifest(file, public(tmp_path))


def test_a_key_of_another_kind_is_refused(bundle: Path, tmp_path: Path) -> None:
    file = tmp_path / "key.pem"
    other = generate_private_key(SECP256R1()).public_key()
    for content in (b"no key", other.public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)):
        file.write_bytes(content)
        with pytest.raises(BundleError, match="public key"):
            read_manifest(bundle, file)


def test_the_maintainers_command_signs_wheels(bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    private = tmp_path / "private.pem"
    private.write_bytes(KEY.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    out = tmp_path / "made.bundle"
    wheels = [str(file) for file in tmp_path.glob("*.whl")]
    monkeypatch.setattr("sys.argv", ["", "--key", str(private), "--version", "1.1.0", "--out", str(out), *wheels])
    assert update_bundle.main() == 0
    assert out.read_bytes() == bundle.read_bytes()
