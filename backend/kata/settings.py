"""Settings of the service. The command line overrides the environment (``KATA_...``), which overrides these defaults."""

import logging
import os
from datetime import time
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any, Final, Literal, Self
from urllib.parse import urlsplit
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from platformdirs import user_data_path
from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

log = logging.getLogger(__name__)

FORMER_NAMES: Final = {
    "backups": "backup_dir",
    "backup_at": "backup_time",
    "clinic_zone": "clinic_time_zone",
    "metrics_token": "metrics_token_file",
    "sign_in_hours": "login_session_hours",
}
"""New name by former name of each renamed setting. In this release the environment may still use a former name; the log then warns."""
_warned: set[str] = set()


class _FormerNamesSource(PydanticBaseSettingsSource):
    """Reads settings from environment variables that have former names."""

    def get_field_value(self, field: FieldInfo, field_name: str) -> tuple[Any, str, bool]:
        """Return the value of one field, or None if no former name is set."""
        former = next((former for former, name in FORMER_NAMES.items() if name == field_name), None)
        variable = f"KATA_{former.upper()}" if former else ""
        value = os.environ.get(variable) or None
        if value is not None and variable not in _warned:
            _warned.add(variable)
            log.warning(
                "%s is now called KATA_%s; the next release ignores the former name", variable, field_name.upper()
            )
        return value, field_name, False

    def __call__(self) -> dict[str, Any]:
        """Return all settings that are set by former names."""
        values = {name: self.get_field_value(field, name)[0] for name, field in self.settings_cls.model_fields.items()}
        return {name: value for name, value in values.items() if value is not None}


class Settings(BaseSettings):
    """All settings that differ between installations. Settings that differ between stations are in their TOML files."""

    model_config = SettingsConfigDict(env_prefix="KATA_", env_ignore_empty=True, extra="ignore")

    data: Path = Field(default_factory=lambda: user_data_path("kata"))
    """Folder for database, journals and the simulator's files."""
    database_url: str = ""
    """SQLAlchemy's database URL; empty: a SQLite file in the data folder. Connections to PostgreSQL on another computer use TLS and
    verify the server's certificate and name, unless the URL contains another ``sslmode``."""
    database_pooler_url: str = ""
    """URL of the same PostgreSQL database through a pooler that shares its connections between transactions (PgBouncer,
    ``pool_mode = transaction``). The service's requests use it. The overview of the stations, upgrades, locks and backups use
    ``KATA_DATABASE_URL``."""
    station: Path | None = None
    """The station's TOML file."""
    simulate: bool = False
    """Start a simulated apparatus instead of opening the station's port."""
    seed: int | None = None
    """Seed of a variation of the simulated mechanics by up to 30 %. Default: no variation."""
    rate_hz: int | None = None
    """Rate of samples and setpoints, in Hz, instead of the rate in the station's file."""
    real_time: bool = True
    """Let the control loop request real-time privileges."""
    taught: Path | None = None
    """Folder of recorded motions (CSV) that the simulated hand can follow."""
    clinic_name: str = ""
    """First line of the head of printed reports. Empty parts of the head are not printed."""
    clinic_address: str = ""
    """Address in the head of printed reports; lines separated by ``|``."""
    clinic_phone: str = ""
    """Telephone number in the head of printed reports."""
    clinic_logo: Path | None = None
    """Logo in the head of printed reports: PNG or SVG, up to 256 kB."""
    clinic_time_zone: str = ""
    """IANA name of the clinic's time zone (``Asia/Tokyo``), in which every day and time is stated. Empty: the named zone of the computer at
    the first start; if it has none, UTC until an administrator sets a zone. All services on one database need the same value."""
    fhir_identifier_system: str = Field(default="", max_length=255)
    """URI that names the clinic's patient numbers in FHIR (JP Core: ``urn:oid:1.2.392.100495.20.3.51.1`` and the clinic's ten digits).
    Empty: a URI that is the same in every clinic that runs Kata.
    """
    fhir_profiles: str = ""
    """Profiles that exported FHIR resources claim in ``meta.profile``: ``Type=address``, separated by commas."""
    backup_dir: Path | None = None
    """Folder for backups, preferably on another disk or computer; default: ``backups`` in the data folder."""
    backup_time: str = "02:30"
    """Time of the daily backup in the clinic's time zone, or ``never``. If the computer is off at this time, it makes the backup later."""
    backup_key: Path | None = None
    """The key that opens backups; default: ``backup-key.txt`` in the data folder."""
    backup_recipients: str = ""
    """Further public keys (age1...) for which backups are encrypted, separated by commas."""
    audit_anchor: Path | None = None
    """File outside the database that anchors the audit trail; default: in the data folder."""
    audit_anchor_copy: Path | None = None
    """A second file, on another disk or computer, to which every line of the anchor is copied. Its folder must exist. It shows whether
    database and anchor were shortened or replaced together, unless the same program or person can also change this file.
    """
    host: str = "127.0.0.1"
    """Address on which the service listens."""
    port: int = 8000
    """Port on which the service listens."""
    allowed_hosts: str = ""
    """Names and addresses, besides this computer's own, by which browsers may reach the service; separated by commas."""
    tls_certificate: Path | None = None
    """The clinic's certificate with its chain (PEM). Without it, a service that other computers can reach makes a self-signed
    certificate.
    """
    tls_key: Path | None = None
    """The certificate's private key (PEM, without a password), readable only by the service's user."""
    metrics_token_file: Path | None = None
    """File with the token for /metrics, at least 20 characters. Without it only logged-in users may read metrics."""
    log_format: Literal["plain", "json"] = "plain"
    """Format of the log: ``plain``, or ``json`` for log collectors (one object per line)."""
    plain_http: bool = False
    """Serve without encryption although other computers can reach the service. Use it only behind a proxy that encrypts."""
    connections_per_address: int = Field(default=100, ge=10)
    """Maximum number of connections of one address that are open or whose request is still being answered. Trusted proxies have no
    limit. An address may open this number of connections each second, and twice this number at once. A page uses up to seven.
    """
    trusted_proxies: str = ""
    """Addresses of proxies whose ``X-Forwarded-For`` and ``-Proto`` are trusted, separated by commas; empty: none."""

    idle_minutes: float = Field(default=15.0, gt=0)
    """The screen locks after this time without activity of the user. A running treatment stays visible and can be stopped."""
    login_session_hours: float = Field(default=12.0, gt=0)
    """A login session ends after this time, even with activity."""
    second_factor: Literal["administrators", "everyone", "nobody"] = "administrators"
    """The accounts that must have a second factor. All others may have one."""
    second_factor_key: Path | None = None
    """The key that encrypts second factors in the database; default: ``second-factor-key.txt`` in the data folder. All services on one
    database need the same key."""
    openid_issuer: str = Field(default="", max_length=255)
    """Issuer of the clinic's OpenID Connect provider: the address before ``/.well-known/openid-configuration``. Empty: none."""
    openid_client_id: str = ""
    """The provider's client id for this service."""
    openid_secret_file: Path | None = None
    """File with the client secret, readable only by the service's user; empty for a public client."""
    openid_name: str = Field(default="The clinic's sign-in", min_length=1, max_length=60)
    """The provider's name on the login page."""
    openid_second_factor: str = ""
    """Values of ``acr`` or ``amr``, separated by commas, by which the provider states that it has checked a second factor. Without one
    of these values Kata asks for its own second factor.
    """

    @classmethod
    def settings_customise_sources(
        cls, settings_cls: type[BaseSettings], init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource, dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:  # fmt: skip
        """Read former names if the current name is not set."""
        return init_settings, env_settings, _FormerNamesSource(settings_cls)

    @field_validator("data")
    @classmethod
    def _absolute(cls, data: Path) -> Path:
        return data.absolute()

    @field_validator("database_url", "database_pooler_url")
    @classmethod
    def _address(cls, url: str) -> str:
        try:
            if url:
                make_url(url)
        except (ArgumentError, ValueError) as error:
            # The message must not contain the value, which may contain a password.
            raise ValueError(
                "must be the address of a database, such as postgresql+psycopg://kata@server/kata"
            ) from error
        return url

    @field_validator("backup_time")
    @classmethod
    def _time_of_day(cls, at: str) -> str:
        try:
            return at if at == "never" else f"{time.fromisoformat(at):%H:%M}"
        except ValueError as error:
            raise ValueError("must be a time of day such as 02:30, or never") from error

    @field_validator("fhir_identifier_system")
    @classmethod
    def _uri(cls, system: str) -> str:
        if system and not _is_uri(system):
            raise ValueError("must be a URI such as urn:oid:1.2.3 or https://clinic.example/patients")
        return system

    @field_validator("fhir_profiles")
    @classmethod
    def _profiles(cls, profiles: str) -> str:
        pairs = [pair.partition("=") for pair in _parted(profiles)]
        if any(not kind.isalpha() or not _is_uri(address) for kind, _, address in pairs):
            raise ValueError(
                "must be types of resources with addresses, such as Patient=http://..., separated by commas"
            )
        return profiles

    @field_validator("clinic_time_zone")
    @classmethod
    def _known(cls, zone: str) -> str:
        try:
            if zone:
                ZoneInfo(zone)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise ValueError(f"is not a time zone that this computer knows: {zone}") from error
        return zone

    @field_validator("allowed_hosts")
    @classmethod
    def _hosts(cls, hosts: str) -> str:
        if any("*" in name or "/" in name for name in hosts.split(",")):
            raise ValueError("must be host names without scheme, port or wildcard, separated by commas")
        return hosts

    @field_validator("openid_issuer")
    @classmethod
    def _issuer(cls, issuer: str) -> str:
        if issuer and (not is_safe(issuer) or {"?", "#", " "} & set(issuer)):
            raise ValueError("must be the provider's issuer, an address that begins with https://")
        return issuer

    @field_validator("trusted_proxies")
    @classmethod
    def _proxies(cls, proxies: str) -> str:
        try:
            for address in _parted(proxies):
                ip_network(address)
        except ValueError as error:
            raise ValueError("must be addresses or networks, separated by commas") from error
        return proxies

    @model_validator(mode="after")
    def _pair(self) -> Self:
        if (self.tls_certificate is None) != (self.tls_key is None):
            raise ValueError("certificate and key must be set together: KATA_TLS_CERTIFICATE, KATA_TLS_KEY")
        if self.database_pooler_url and not self.database_url.startswith("postgresql"):
            raise ValueError("a pooler needs the address of PostgreSQL itself too: KATA_DATABASE_URL")
        if bool(self.openid_issuer) != bool(self.openid_client_id):
            raise ValueError("issuer and client id must be set together: KATA_OPENID_ISSUER, KATA_OPENID_CLIENT_ID")
        return self

    def as_environment(self) -> dict[str, str]:
        """Return the environment variables that give another process the same settings, because process lists would show a password in
        arguments.
        """
        values = self.model_dump(mode="json", exclude_none=True)
        return {f"KATA_{name.upper()}": str(value) for name, value in values.items()}

    @property
    def encrypted(self) -> bool:
        """Return whether the service uses TLS: it has the clinic's certificate, or other computers can reach it without a proxy."""
        return self.tls_certificate is not None or not (self.is_on_loopback or self.plain_http)

    @property
    def fhir_profile_of(self) -> dict[str, str]:
        """Return the address of the claimed profile by type of resource."""
        return {kind: address for kind, _, address in (pair.partition("=") for pair in _parted(self.fhir_profiles))}

    @property
    def named_hosts(self) -> frozenset[str]:
        """Return ``allowed_hosts`` as a set of lower-case names."""
        return frozenset(name.lower() for name in _parted(self.allowed_hosts))

    @property
    def effective_database_url(self) -> str:
        """Return the URL of the database that is opened."""
        return by_tls(self.database_url) if self.database_url else f"sqlite:///{self.data / 'kata.db'}"

    @property
    def effective_database_pooler_url(self) -> str:
        """Return the URL of the pooler, or an empty text if there is none."""
        return by_tls(self.database_pooler_url) if self.database_pooler_url else ""

    @property
    def effective_audit_anchor(self) -> Path:
        """Return the file of the audit anchor."""
        return self.audit_anchor or self.data / "audit.anchor"

    @property
    def is_on_loopback(self) -> bool:
        """Return whether only this computer can reach the service."""
        return _is_this_computer(self.host)

    @property
    def journal(self) -> Path:
        """Return the folder of journals."""
        return self.data / "journal"

    @property
    def spool(self) -> Path:
        """Return the folder of the station's records that are not yet in the database."""
        return self.data / "spool"

    @property
    def unlisted_proxy_file(self) -> Path:
        """Return the file with the address of a proxy that ``trusted_proxies`` lacks. The service writes it, and ``kata doctor`` reads
        it.
        """
        return self.data / "unlisted-proxy.txt"

    @property
    def effective_second_factor_key(self) -> Path:
        """Return the file of the second factors' key."""
        return (self.second_factor_key or self.data / "second-factor-key.txt").absolute()

    @property
    def backup_folder(self) -> Path:
        """Return the folder of backups."""
        return (self.backup_dir or self.data / "backups").absolute()

    @property
    def backup_key_file(self) -> Path:
        """Return the file of the backup key."""
        return (self.backup_key or self.data / "backup-key.txt").absolute()


_REQUIREMENTS: Final = {
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_parsing": "must be a number",
    "bool_parsing": "must be true or false",
    "greater_than": "must be more than {gt:g}",
    "literal_error": "must be {expected}",
    "string_too_short": "must not be empty",
    "string_too_long": "must have {max_length} characters at most",
}


def address_lines(address: str) -> tuple[str, ...]:
    """Return the lines of ``clinic_address``, without empty ones."""
    return tuple(_parted(address, "|"))


def describe_errors(error: ValidationError) -> str:
    """Return one sentence for each invalid setting. The sentences do not contain the values, which may be secret."""
    sentences = []
    for detail in error.errors(include_url=False, include_input=False):
        context = detail.get("ctx", {})
        requirement = _REQUIREMENTS.get(detail["type"], detail["msg"])
        requirement = str(context["error"]) if "error" in context else requirement.format(**context)
        name = f"KATA_{str(detail['loc'][0]).upper()} " if detail["loc"] else ""
        sentences.append(f"{name}{requirement}.")
    return " ".join(f"{sentence[:1].upper()}{sentence[1:]}" for sentence in sentences)


def by_tls(database_url: str) -> str:
    """Return the URL with ``sslmode=verify-full`` if PostgreSQL is on another computer and the URL has no ``sslmode``."""
    url = make_url(database_url)
    named = url.query.get("host") or url.host or ""
    hosts = [host for part in ((named,) if isinstance(named, str) else named) for host in part.split(",") if host]
    is_local = all(
        host.startswith(("/", "@")) or _is_this_computer(host.partition(":")[0] if host.count(":") == 1 else host)
        for host in hosts
    )
    if url.get_backend_name() != "postgresql" or is_local or "sslmode" in url.query:
        return database_url
    return url.update_query_dict({"sslmode": "verify-full"}).render_as_string(hide_password=False)


def is_safe(url: object) -> bool:
    """Return whether a connection to the URL cannot be intercepted: it uses TLS or stays on this computer."""
    parts = urlsplit(url) if isinstance(url, str) else None
    if parts is None or not parts.hostname:
        return False
    return parts.scheme == "https" or (parts.scheme == "http" and _is_this_computer(parts.hostname))


def _is_uri(text: str) -> bool:
    """Return whether the text is an absolute URI without spaces, as FHIR requires."""
    scheme, colon, rest = text.partition(":")
    return bool(colon and rest) and scheme.isalpha() and not any(sign.isspace() for sign in text)


def _is_this_computer(host: str) -> bool:
    """Return whether a host is a loopback address or ``localhost``. Other names are not trusted to be this computer."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _parted(text: str, separator: str = ",") -> list[str]:
    return [part.strip() for part in text.split(separator) if part.strip()]
