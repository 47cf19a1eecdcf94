"""TLS off loopback, with the clinic's certificate or a self-signed one."""

import asyncio
import http.client
import re
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from kata.api.security_middleware import allowed_hosts
from kata.api.tls import Certificate, TlsError, refreshed
from kata.database.base import utc_now
from kata.settings import Settings
from tests.support.file_modes import open_to_others
from tests.support.ports import free_port


def made(folder: Path, **settings: object) -> Certificate:
    given = Settings(data=folder, host="192.0.2.7", **settings)  # type: ignore[arg-type]
    return Certificate(given, allowed_hosts(given))


def read(path: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate(path.read_bytes())


def test_generated_certificate_names_the_addresses_of_the_service(tmp_path: Path) -> None:
    certificate = made(tmp_path, allowed_hosts="kata.clinic.example")
    found = read(certificate.file)
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert {"localhost", "127.0.0.1", "192.0.2.7", "kata.clinic.example"} <= {str(name.value) for name in names}
    assert timedelta(days=390) < found.not_valid_after_utc - utc_now() <= timedelta(days=397)
    assert not found.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_only_its_owner_can_read_the_key(tmp_path: Path) -> None:
    certificate = made(tmp_path)
    assert certificate.file.with_name("key.pem").stat().st_mode & 0o777 == 0o600
    assert certificate.file.parent.stat().st_mode & 0o777 == 0o700


def test_certificate_is_kept_until_due_and_then_renewed(tmp_path: Path) -> None:
    first = made(tmp_path).fingerprint
    again = made(tmp_path)
    assert again.fingerprint == first
    assert not again.refresh(utc_now() + timedelta(days=366))
    assert again.refresh(utc_now() + timedelta(days=368))
    assert again.fingerprint != first


def test_certificate_is_renewed_for_another_name_or_mismatched_key(tmp_path: Path) -> None:
    first = made(tmp_path).fingerprint
    second = made(tmp_path, allowed_hosts="kata.clinic.example").fingerprint
    assert second != first
    other = made(tmp_path / "other")
    (tmp_path / "tls" / "key.pem").write_bytes(other.file.with_name("key.pem").read_bytes())
    assert made(tmp_path, allowed_hosts="kata.clinic.example").fingerprint not in (first, second)


def clinics(folder: Path) -> tuple[Path, Path]:
    """Write a certificate and key like those of a clinic."""
    there = made(folder).file
    return there, there.with_name("key.pem")


def test_clinics_certificate_is_used_and_reloaded_when_replaced(tmp_path: Path) -> None:
    file, key = clinics(tmp_path / "clinic")
    certificate = made(tmp_path / "kata", tls_certificate=file, tls_key=key)
    assert certificate.fingerprint == read(file).fingerprint(hashes.SHA256()).hex(":").upper()
    assert not (tmp_path / "kata").exists(), "the service makes no certificate"
    assert not certificate.refresh(utc_now() + timedelta(days=1000)), (
        "the service does not renew the clinic's certificate"
    )
    newer, newer_key = clinics(tmp_path / "newer")
    file.write_bytes(newer.read_bytes())
    key.write_bytes(newer_key.read_bytes())
    assert certificate.refresh(utc_now())


def test_clinics_key_that_is_readable_or_unreadable_is_refused(tmp_path: Path) -> None:
    file, key = clinics(tmp_path)
    key.chmod(0o604)
    with pytest.raises(TlsError, match="Other users of this computer can read the key"):
        made(tmp_path, tls_certificate=file, tls_key=key)
    key.chmod(0o600)
    plain = serialization.load_pem_private_key(key.read_bytes(), None)
    locked = plain.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.BestAvailableEncryption(b"a password"),
    )
    key.write_bytes(locked)
    with pytest.raises(TlsError, match="has a password"):
        made(tmp_path, tls_certificate=file, tls_key=key)
    key.write_bytes(b"no key")
    with pytest.raises(TlsError, match="cannot be used"):
        made(tmp_path, tls_certificate=file, tls_key=key)
    with pytest.raises(TlsError, match="cannot be used"):
        made(tmp_path, tls_certificate=file, tls_key=tmp_path / "none.pem")


def test_certificate_renewal_ends_with_the_service(tmp_path: Path) -> None:
    async def whole() -> int:
        async with refreshed(made(tmp_path)):
            during = len(asyncio.all_tasks())
        return during - len(asyncio.all_tasks())

    assert asyncio.run(whole()) == 1


@pytest.fixture(scope="module")
def on_the_network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[int, ssl.SSLContext, Path]]:
    """Run `kata serve` off loopback. Return the port, the TLS context of a browser that trusts the certificate, and the log file."""
    folder, port = tmp_path_factory.mktemp("kata"), free_port()
    folder.chmod(0o755)
    answer = folder / "service.log"
    command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(folder), "--host", "0.0.0.0"]
    with answer.open("wb") as log, subprocess.Popen([*command, "--port", str(port)], stderr=log) as service:
        limit = time.monotonic() + 60
        while "Kata is ready" not in answer.read_text():
            assert service.poll() is None, answer.read_text()
            assert time.monotonic() < limit, answer.read_text()
            time.sleep(0.1)
        context = ssl.create_default_context(cafile=str(folder / "tls" / "certificate.pem"))
        yield port, context, answer
        service.terminate()
        service.wait(20)


@pytest.mark.campaign
def test_started_by_hand_other_users_can_read_nothing(on_the_network: tuple[int, ssl.SSLContext, Path]) -> None:
    _, _, log = on_the_network
    assert len([path for path in log.parent.rglob("*") if path.is_file()]) > 5
    assert open_to_others(log.parent) == []


def test_off_loopback_only_tls_is_spoken(on_the_network: tuple[int, ssl.SSLContext, Path]) -> None:
    port, context, found = on_the_network
    asking = http.client.HTTPSConnection("localhost", port, context=context, timeout=20)
    asking.request("GET", "/health/live")
    answer = asking.getresponse()
    assert answer.status == 200
    assert answer.headers["strict-transport-security"] == "max-age=31536000; includeSubDomains"
    assert answer.headers["server"] is None
    assert isinstance(asking.sock, ssl.SSLSocket) and asking.sock.version() in ("TLSv1.2", "TLSv1.3")
    asking.close()
    plain = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    plain.request("GET", "/health/live")
    with pytest.raises((http.client.HTTPException, OSError)):
        plain.getresponse()
    assert re.search(rf"https://localhost:{port}\b", found.read_text())
    assert "fingerprint" in found.read_text()


def test_demonstration_link_is_not_offered_off_loopback(
    on_the_network: tuple[int, ssl.SSLContext, Path],
) -> None:
    _, _, answer = on_the_network
    assert "link=" not in re.sub(r"\S*set-up\S*", "", answer.read_text())


@pytest.mark.parametrize("ciphers", ["ECDHE+AES:!AESGCM:!AESCCM", "AES128-GCM-SHA256"])
def test_ciphers_without_authentication_or_forward_secrecy_are_refused(
    on_the_network: tuple[int, ssl.SSLContext, Path], ciphers: str
) -> None:
    old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    old.check_hostname, old.verify_mode = False, ssl.CERT_NONE
    old.maximum_version = ssl.TLSVersion.TLSv1_2
    old.set_ciphers(ciphers)
    connection = socket.create_connection(("127.0.0.1", on_the_network[0]), timeout=20)
    with connection, pytest.raises((ssl.SSLError, ConnectionError)):
        old.wrap_socket(connection)


def test_our_tls_context_refuses_versions_older_than_1_2(tmp_path: Path) -> None:
    assert made(tmp_path).context.minimum_version == ssl.TLSVersion.TLSv1_2


def _handshake(port: int, version: ssl.TLSVersion, ciphers: str) -> tuple[str, str | None, bytes] | None:
    """Return cipher, compression and certificate of a connection with only this version and these ciphers; None if it is refused."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.set_ciphers(ciphers)
    context.minimum_version = context.maximum_version = version
    context.options &= ~ssl.OP_NO_COMPRESSION
    try:
        connection = socket.create_connection(("127.0.0.1", port), timeout=20)
        with connection, context.wrap_socket(connection) as wrapped:
            cipher = wrapped.cipher()
            assert cipher
            return cipher[0], wrapped.compression(), wrapped.getpeercert(binary_form=True) or b""
    except (ssl.SSLError, ConnectionError):
        return None


def test_every_accepted_cipher_is_authenticated_with_forward_secrecy(
    on_the_network: tuple[int, ssl.SSLContext, Path],
) -> None:
    port = on_the_network[0]
    every = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    every.set_ciphers("ALL:COMPLEMENTOFALL:@SECLEVEL=0")
    names = [cipher["name"] for cipher in every.get_ciphers() if cipher["protocol"] != "TLSv1.3"]
    assert len(names) > 50
    assert {name for name in names if _handshake(port, ssl.TLSVersion.TLSv1_2, f"{name}:@SECLEVEL=0")} == {
        "ECDHE-ECDSA-AES256-GCM-SHA384",
        "ECDHE-ECDSA-AES128-GCM-SHA256",
        "ECDHE-ECDSA-CHACHA20-POLY1305",
    }


@pytest.mark.filterwarnings("ignore:ssl.TLSVersion:DeprecationWarning")
def test_old_versions_are_refused_and_new_ones_without_compression(
    on_the_network: tuple[int, ssl.SSLContext, Path],
) -> None:
    port = on_the_network[0]
    for old in (ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1):
        assert _handshake(port, old, "ALL:@SECLEVEL=0") is None
    for new in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
        shaken = _handshake(port, new, "ALL")
        assert shaken is not None
        assert shaken[1] is None
    # The order of the server counts, not that of the client.
    weakest_first = "ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-ECDSA-AES256-GCM-SHA384"
    shaken = _handshake(port, ssl.TLSVersion.TLSv1_2, weakest_first)
    assert shaken is not None
    assert shaken[0] == "ECDHE-ECDSA-AES256-GCM-SHA384"


def test_served_certificate_is_strong_named_and_short_lived(
    on_the_network: tuple[int, ssl.SSLContext, Path],
) -> None:
    port, _, log = on_the_network
    shaken = _handshake(port, ssl.TLSVersion.TLSv1_3, "ALL")
    assert shaken is not None
    served = x509.load_der_x509_certificate(shaken[2])
    key = served.public_key()
    assert isinstance(key, ec.EllipticCurvePublicKey) and key.curve.name == "secp256r1"
    assert isinstance(served.signature_hash_algorithm, hashes.SHA256)
    assert served.not_valid_before_utc <= utc_now()
    assert timedelta(days=360) < served.not_valid_after_utc - utc_now() <= timedelta(days=397)
    names = served.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert {"localhost", "127.0.0.1"} <= {str(name.value) for name in names}
    usage = served.extensions.get_extension_for_class(x509.KeyUsage).value
    assert usage.digital_signature and not usage.key_cert_sign
    assert (log.parent / "tls" / "key.pem").stat().st_mode & 0o777 == 0o600


def test_neither_renegotiation_nor_compression_is_offered(tmp_path: Path) -> None:
    options = made(tmp_path).context.options
    assert options & ssl.OP_NO_RENEGOTIATION
    assert options & ssl.OP_NO_COMPRESSION
