"""TLS with the clinic's certificate, or with a self-signed certificate that the service creates and renews.

Browsers warn of a self-signed certificate until they trust it. At its start, the service prints the certificate's fingerprint for
comparison. The clinic's
certificate may be replaced while the service runs: new connections get the new one.
"""

import asyncio
import contextlib
import logging
import socket
import ssl
from collections.abc import AsyncIterator, Iterable
from datetime import datetime, timedelta
from ipaddress import ip_address
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from kata.database.base import utc_now
from kata.settings import Settings
from kata.system.files import write_private_file

log = logging.getLogger(__name__)

_VALID: Final = timedelta(days=397)
"""Validity of a self-signed certificate. Browsers refuse certificates that are valid for longer."""
_RENEW_BEFORE_END: Final = timedelta(days=30)
"""A self-signed certificate is renewed this long before its end."""
_CLOCK_TOLERANCE: Final = timedelta(hours=1)
_REFRESH_PERIOD_S: Final = 3600.0
_CIPHERS: Final = "ECDHE+AESGCM:ECDHE+CHACHA20"
"""Ciphers of TLS 1.2 with forward secrecy and authenticated encryption. All ciphers of TLS 1.3 have both."""


class TlsError(Exception):
    """TLS cannot be used. The message says why and what to do."""


class Certificate:
    """A certificate with its key, and the TLS context for new connections."""

    def __init__(self, settings: Settings, hosts: Iterable[str]) -> None:
        """``hosts``: names and addresses in a self-signed certificate.

        :raises TlsError: when the clinic's certificate or its key cannot be used.
        """
        self._hosts = sorted({host.strip("[]") for host in hosts} | _addresses(settings.host))
        self._is_self_signed = settings.tls_certificate is None
        folder = settings.data / "tls"
        self.file = settings.tls_certificate or folder / "certificate.pem"
        self._key = settings.tls_key or folder / "key.pem"
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self.context.minimum_version = ssl.TLSVersion.TLSv1_2
        self.context.set_ciphers(_CIPHERS)
        self.context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION | ssl.OP_CIPHER_SERVER_PREFERENCE
        self._loaded: bytes | None = None
        self.refresh(utc_now())

    @property
    def fingerprint(self) -> str:
        """Return the SHA-256 fingerprint in the form that browsers show."""
        return x509.load_pem_x509_certificate(self.file.read_bytes()).fingerprint(hashes.SHA256()).hex(":").upper()

    def refresh(self, now: datetime) -> bool:
        """Renew a self-signed certificate that is due, and load changed files. Return whether the files had changed.

        :raises TlsError: when the files cannot be used. The loaded certificate stays in use.
        """
        if self._is_self_signed and self._is_due(now):
            self._make(now)
        try:
            if not self._is_self_signed and self._key.stat().st_mode & 0o007:
                raise TlsError(f"Other users of this computer can read the key {self._key}: chmod 600 {self._key}")
            content = self.file.read_bytes() + self._key.read_bytes()
            if content == self._loaded:
                return False
            self.context.load_cert_chain(self.file, self._key, password=_no_password)
        except (OSError, ssl.SSLError) as error:
            raise TlsError(f"The certificate {self.file} with the key {self._key} cannot be used: {error}") from error
        self._loaded = content
        return True

    def _is_due(self, now: datetime) -> bool:
        try:
            present = x509.load_pem_x509_certificate(self.file.read_bytes())
            names = present.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
            key = serialization.load_pem_private_key(self._key.read_bytes(), None)
        except (OSError, ValueError, TypeError, x509.ExtensionNotFound):
            return True
        covered = {str(name.value) for name in names}
        return (
            present.not_valid_after_utc - now < _RENEW_BEFORE_END
            or not covered.issuperset(self._hosts)
            or present.public_key() != key.public_key()
        )

    def _make(self, now: datetime) -> None:
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Kata")])
        usage = x509.KeyUsage(
            digital_signature=True,
            content_commitment=False,
            key_encipherment=False,
            data_encipherment=False,
            key_agreement=False,
            key_cert_sign=False,
            crl_sign=False,
            encipher_only=False,
            decipher_only=False,
        )
        certificate = (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(name)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - _CLOCK_TOLERANCE)
            .not_valid_after(now + _VALID)
            .add_extension(x509.SubjectAlternativeName([_general_name(host) for host in self._hosts]), critical=False)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
            .add_extension(usage, critical=True)
            .sign(key, hashes.SHA256())
        )
        pem = serialization.Encoding.PEM
        secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        try:
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            # If the process ends between the two writes, the files do not match, and the next start creates both again.
            write_private_file(self._key, secret)
            write_private_file(self.file, certificate.public_bytes(pem))
        except OSError as error:
            raise TlsError(f"The certificate cannot be written to {self.file.parent}: {error.strerror}") from error


@contextlib.asynccontextmanager
async def refreshed(certificate: Certificate) -> AsyncIterator[None]:
    """Refresh the certificate every hour while the context lasts."""
    refreshing = asyncio.create_task(_refresh_hourly(certificate), name="certificate")
    try:
        yield
    finally:
        refreshing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await refreshing


async def _refresh_hourly(certificate: Certificate) -> None:
    while True:
        await asyncio.sleep(_REFRESH_PERIOD_S)
        try:
            if await asyncio.to_thread(certificate.refresh, utc_now()):
                log.info("new connections use the certificate %s", certificate.fingerprint)
        except TlsError as error:
            log.error("%s The previous certificate stays in use.", error)


def _addresses(host: str) -> set[str]:
    """Return the addresses at which other computers reach a service that listens on ``host``."""
    try:
        if not ip_address(host).is_unspecified:
            return {host}
    except ValueError:
        return {host.lower()}
    addresses = set()
    # Connecting a UDP socket sends nothing but selects this computer's address. The targets are reserved for documentation.
    for family, target in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((target, 9))
            addresses.add(str(probe.getsockname()[0]))
    return addresses


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _no_password() -> str:
    """Raise an error, so that OpenSSL does not ask for the password on the terminal."""
    raise TlsError("The certificate's key has a password, which an automatic start cannot enter: remove the password.")
