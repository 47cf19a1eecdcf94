"""PostgreSQL on another computer: encrypted connections to a verified server, with a client certificate instead of a password."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from ipaddress import ip_address
from pathlib import Path
from tempfile import mkdtemp

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from sqlalchemy.exc import OperationalError

from kata.database.base import utc_now
from kata.database.database_copy import copy
from kata.database.engine import Database
from kata.database.postgresql_programs import postgresql_program
from kata.settings import Settings, by_tls
from tests.support.ports import free_port

AWAY = "postgresql+psycopg://kata@database.clinic.example/kata"


@pytest.mark.parametrize(
    "url",
    [
        AWAY,
        "postgresql+psycopg://kata:secret@192.168.1.7:5433/kata",
        "postgresql+psycopg://kata@/kata?host=one.example:5432&host=localhost",
    ],
)
def test_remote_postgresql_is_reached_by_verified_tls(url: str) -> None:
    assert "sslmode=verify-full" in Settings(database_url=url).effective_database_url
    assert by_tls(url).partition("?")[0] == url.partition("?")[0], "with its password, if there is one"


@pytest.mark.parametrize(
    "url",
    [
        "postgresql+psycopg://kata@/kata?host=/run/postgresql",
        "postgresql+psycopg://kata@localhost/kata",
        "postgresql+psycopg://kata@127.0.0.1:5432/kata",
        "postgresql+psycopg://kata@[::1]/kata",
        "postgresql+psycopg:///kata",
        f"{AWAY}?sslmode=require",
        "sqlite:////srv/kata.db",
    ],
)
def test_local_or_explicit_postgresql_settings_are_left_unchanged(url: str) -> None:
    assert Settings(database_url=url).effective_database_url == url


@dataclass(frozen=True)
class Server:
    """A server on 127.0.0.1 that accepts only TLS, and only clients with its authority's certificate for ``kata``."""

    port: int
    folder: Path

    def url(self, **more: str | Path) -> str:
        answer = {"sslmode": "verify-full", "sslrootcert": self.folder / "authority.pem"} | more
        return f"postgresql+psycopg://kata@127.0.0.1:{self.port}/postgres?" + "&".join(
            f"{k}={v}" for k, v in answer.items()
        )

    @property
    def ours(self) -> dict[str, str | Path]:
        return {"sslcert": self.folder / "kata.pem", "sslkey": self.folder / "kata.key"}


class Authority:
    def __init__(self, name: str) -> None:
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        self.certificate = self._signed(self._name, self._key.public_key(), ca=True)

    def _signed(self, subject: x509.Name, key: ec.EllipticCurvePublicKey, *, ca: bool) -> x509.Certificate:
        now, address = utc_now(), x509.IPAddress(ip_address("127.0.0.1"))
        made = x509.CertificateBuilder(self._name, subject, key, x509.random_serial_number())
        made = made.not_valid_before(now - timedelta(hours=1)).not_valid_after(now + timedelta(hours=1))
        made = made.add_extension(x509.BasicConstraints(ca=ca, path_length=None), critical=True)
        return made.add_extension(x509.SubjectAlternativeName([address]), critical=False).sign(
            self._key, hashes.SHA256()
        )

    def issue(self, name: str, folder: Path) -> None:
        """Write a certificate ``name.pem`` and its key ``name.key``."""
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        pem = serialization.Encoding.PEM
        secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        (folder / f"{name}.pem").write_bytes(self._signed(subject, key.public_key(), ca=False).public_bytes(pem))
        (folder / f"{name}.key").write_bytes(secret)
        (folder / f"{name}.key").chmod(0o600)


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    initdb = postgresql_program("initdb")
    if initdb is None:
        pytest.skip("PostgreSQL's programs are not on this computer.")
    user = "postgres" if os.geteuid() == 0 else None
    folder, port = Path(mkdtemp(prefix="kata-postgresql-")), free_port()
    data = folder / "data"
    for name, authority in ((name, Authority(name)) for name in ("authority", "another")):
        (folder / f"{name}.pem").write_bytes(authority.certificate.public_bytes(serialization.Encoding.PEM))
        if name == "authority":
            for whose in ("server", "kata", "somebody"):
                authority.issue(whose, folder)
    if user:
        for path in (folder, folder / "server.pem", folder / "server.key"):
            shutil.chown(path, user)
        folder.chmod(0o755)
    control = [
        str(initdb.with_name("pg_ctl")),
        "--pgdata",
        str(data),
        "--wait",
        "--silent",
        "--log",
        str(folder / "log"),
    ]
    try:
        subprocess.run(
            [initdb, "--pgdata", data, "--username", "kata", "--auth", "reject"],
            check=True, capture_output=True, user=user, cwd=folder,
        )  # fmt: skip
        (data / "pg_hba.conf").write_text("hostssl all all 127.0.0.1/32 cert\n")
        options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off -c ssl=on"
        for name, file in (
            ("ssl_cert_file", "server.pem"),
            ("ssl_key_file", "server.key"),
            ("ssl_ca_file", "authority.pem"),
        ):
            options += f" -c {name}={folder / file}"
        subprocess.run([*control, "--options", options, "start"], check=True, user=user, cwd=folder)
        try:
            yield Server(port, folder)
        finally:
            subprocess.run([*control, "--mode", "immediate", "stop"], check=True, user=user, cwd=folder)
    finally:
        shutil.rmtree(folder)


def refusal(url: str) -> str:
    database = Database(url)
    try:
        with pytest.raises(OperationalError) as error, database.reader.connect():
            pass
    finally:
        database.close()
    return str(error.value)


def test_a_certificate_lets_the_service_in_and_its_backup_too(server: Server, tmp_path: Path) -> None:
    database = Database(server.url(**server.ours))
    with database.reader.connect() as connection:
        answer = connection.exec_driver_sql(
            "SELECT version, client_dn FROM pg_stat_ssl WHERE pid = pg_backend_pid()"
        ).one()
    assert tuple(answer) == ("TLSv1.3", "/CN=kata")
    copy(database, tmp_path / "dump")
    assert (tmp_path / "dump").stat().st_size > 0
    database.close()


def test_other_clients_are_refused_and_nothing_is_sent_in_clear(server: Server) -> None:
    assert "connection requires a valid client certificate" in refusal(server.url())
    others = {"sslcert": server.folder / "somebody.pem", "sslkey": server.folder / "somebody.key"}
    assert 'certificate authentication failed for user "kata"' in refusal(server.url(**others))
    assert "no encryption" in refusal(server.url(sslmode="disable"))


def test_unknown_server_receives_nothing(server: Server) -> None:
    stranger = server.url(sslrootcert=server.folder / "another.pem", **server.ours)
    assert "certificate verify failed" in refusal(stranger)
    elsewhere = server.url(**server.ours).replace("@127.0.0.1:", "@localhost:")
    assert 'does not match host name "localhost"' in refusal(elsewhere)
