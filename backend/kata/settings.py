"""Settings of the service: command line first, then environment (``KATA_...``), then these defaults."""

from datetime import time
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Final, Literal, Self
from urllib.parse import urlsplit
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from platformdirs import user_data_path
from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError


class Settings(BaseSettings):
    """One object for everything that differs between deployments. What differs between stations is in their TOML."""

    model_config = SettingsConfigDict(env_prefix="KATA_", env_ignore_empty=True, extra="ignore")

    data: Path = Field(default_factory=lambda: user_data_path("kata"))
    """Folder for database, journals and the simulator's files."""
    database_url: str = ""
    """SQLAlchemy's; a SQLite file in the data folder when empty. To PostgreSQL on another computer it goes by TLS, and only to a server whose
    certificate is good for that name, unless it says another ``sslmode`` itself."""
    station: Path | None = None
    """The station's TOML file."""
    simulate: bool = False
    """Start a simulated apparatus instead of opening the station's port."""
    seed: int | None = None
    """Varies the simulated mechanics by up to 30 %."""
    rate_hz: int | None = None
    """Overrides the station's own."""
    real_time: bool = True
    """Let the control loop ask for real-time privileges; without, it runs as on a computer that grants none."""
    taught: Path | None = None
    """Folder of recorded motions (CSV) that the simulated hand can follow."""
    clinic_name: str = ""
    """Head of printed reports, with what follows; what is empty is left out."""
    clinic_address: str = ""
    """Its lines parted by ``|``."""
    clinic_phone: str = ""
    clinic_logo: Path | None = None
    """PNG or SVG, up to 256 kB."""
    clinic_zone: str = ""
    """Time zone of printed reports, as IANA calls it (``Asia/Tokyo``); this computer's own when empty."""
    backups: Path | None = None
    """Folder for backups, better on another disk or computer; ``backups`` in the data folder unless given."""
    backup_at: str = "02:30"
    """When a backup is made each day, by the clinic's clock; ``never``: none is. A computer that was off then makes it up."""
    backup_key: Path | None = None
    """The key that opens backups; ``backup-key.txt`` in the data folder unless given."""
    backup_recipients: str = ""
    """Public keys (age1...) that open them too, parted by commas."""
    audit_anchor: Path | None = None
    """File outside the database that the audit trail is anchored in; in the data folder unless given. On another disk or computer
    it also shows that both were replaced by an older copy."""
    host: str = "127.0.0.1"
    port: int = 8000
    allowed_hosts: str = ""
    """Names and addresses by which browsers may reach the service, besides this computer's own; separated by commas."""
    tls_certificate: Path | None = None
    """The clinic's certificate with its chain (PEM); one of its own is made where others can reach the service and none is given."""
    tls_key: Path | None = None
    """The certificate's private key (PEM, without a password), readable by the service's user alone."""
    metrics_token: Path | None = None
    """File with the token by which a program may read /metrics, 20 characters or more; without it only people may, signed in."""
    log_format: Literal["plain", "json"] = "plain"
    """json: an object a line, for a program that collects logs."""
    plain_http: bool = False
    """Serve without encryption where others can reach the service: only behind a proxy that encrypts."""
    trusted_proxies: str = ""
    """Addresses of proxies whose ``X-Forwarded-For`` and ``-Proto`` are believed, separated by commas; nobody's when empty."""

    idle_minutes: float = Field(default=15.0, gt=0)
    """After so long without anything done by its user, a browser's screen is locked; what goes on stays visible and stoppable."""
    sign_in_hours: float = Field(default=12.0, gt=0)
    """After so long a sign-in is over, whatever is done."""
    second_factor: Literal["administrators", "everyone", "nobody"] = "administrators"
    """Of whom a second factor is asked; everybody may have one."""
    second_factor_key: Path | None = None
    """The key that second factors are sealed with in the database; ``second-factor-key.txt`` in the data folder unless given. The same for
    each service on one database."""
    openid_issuer: str = Field(default="", max_length=255)
    """The clinic's own OpenID Connect provider, by its issuer: what ``/.well-known/openid-configuration`` is put behind. Empty: there is none."""
    openid_client_id: str = ""
    """By which the provider knows this service."""
    openid_secret_file: Path | None = None
    """File with the client's secret, readable by the service's user alone; none for a public client."""
    openid_name: str = Field(default="The clinic's sign-in", min_length=1, max_length=60)
    """What the provider is called on the page."""
    openid_second_factor: str = ""
    """Values of ``acr`` or ``amr``, separated by commas, by which the provider says that it has asked for a second factor; where it says
    none of these, ours is asked for."""

    @field_validator("data")
    @classmethod
    def _absolute(cls, data: Path) -> Path:
        return data.absolute()

    @field_validator("database_url")
    @classmethod
    def _address(cls, url: str) -> str:
        try:
            if url:
                make_url(url)
        except (ArgumentError, ValueError) as error:
            # What stands there may be a password.
            raise ValueError(
                "must be the address of a database, such as postgresql+psycopg://kata@server/kata"
            ) from error
        return url

    @field_validator("backup_at")
    @classmethod
    def _time_of_day(cls, at: str) -> str:
        try:
            return at if at == "never" else f"{time.fromisoformat(at):%H:%M}"
        except ValueError as error:
            raise ValueError("must be a time of day such as 02:30, or never") from error

    @field_validator("clinic_zone")
    @classmethod
    def _known(cls, zone: str) -> str:
        try:
            if zone:
                ZoneInfo(zone)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise ValueError(f"this computer knows no time zone {zone}") from error
        return zone

    @field_validator("allowed_hosts")
    @classmethod
    def _hosts(cls, hosts: str) -> str:
        if any("*" in name or "/" in name for name in hosts.split(",")):
            raise ValueError("names each host by itself, without scheme or port, separated by commas")
        return hosts

    @field_validator("openid_issuer")
    @classmethod
    def _issuer(cls, issuer: str) -> str:
        if issuer and (not is_safe(issuer) or {"?", "#", " "} & set(issuer)):
            raise ValueError("must be an address that begins with https://, as the provider calls itself")
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
            raise ValueError(
                "a certificate needs its key, and a key its certificate: KATA_TLS_CERTIFICATE, KATA_TLS_KEY"
            )
        if bool(self.openid_issuer) != bool(self.openid_client_id):
            raise ValueError("OpenID Connect takes both: KATA_OPENID_ISSUER, KATA_OPENID_CLIENT_ID")
        return self

    @property
    def encrypted(self) -> bool:
        """Whether the service itself speaks TLS: by the clinic's certificate, or because others can reach it."""
        return self.tls_certificate is not None or not (self.is_on_loopback or self.plain_http)

    @property
    def named_hosts(self) -> frozenset[str]:
        """``allowed_hosts``, each by itself, in lower case."""
        return frozenset(name.lower() for name in _parted(self.allowed_hosts))

    @property
    def effective_database_url(self) -> str:
        """What is really opened."""
        return by_tls(self.database_url) if self.database_url else f"sqlite:///{self.data / 'kata.db'}"

    @property
    def effective_audit_anchor(self) -> Path:
        """The file that is really used."""
        return self.audit_anchor or self.data / "audit.anchor"

    @property
    def is_on_loopback(self) -> bool:
        """Whether only this computer reaches the service."""
        return _is_this_computer(self.host)

    @property
    def journal(self) -> Path:
        """Folder of journals."""
        return self.data / "journal"

    @property
    def spool(self) -> Path:
        """Folder of what happened at the station, until the database has it."""
        return self.data / "spool"

    @property
    def effective_second_factor_key(self) -> Path:
        """The file that is really used."""
        return (self.second_factor_key or self.data / "second-factor-key.txt").absolute()

    @property
    def backup_folder(self) -> Path:
        """Where backups are kept."""
        return (self.backups or self.data / "backups").absolute()

    @property
    def backup_key_file(self) -> Path:
        """The key that opens them."""
        return (self.backup_key or self.data / "backup-key.txt").absolute()


_TAKES: Final = {
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_parsing": "must be a number",
    "bool_parsing": "must be true or false",
    "greater_than": "must be more than {gt:g}",
    "literal_error": "must be {expected}",
    "string_too_short": "must not be empty",
    "string_too_long": "must have {max_length} characters at most",
}


def complaint(error: ValidationError) -> str:
    """What is wrong with the settings, a sentence for each; nothing of what stands in them, which may be secret."""
    sentences = []
    for one in error.errors(include_url=False, include_input=False):
        context = one.get("ctx", {})
        takes = str(context["error"]) if "error" in context else _TAKES.get(one["type"], one["msg"]).format(**context)
        name = f"KATA_{str(one['loc'][0]).upper()} " if one["loc"] else ""
        sentences.append(f"{name}{takes}.")
    return " ".join(f"{said[:1].upper()}{said[1:]}" for said in sentences)


def by_tls(database_url: str) -> str:
    """The same; by TLS with a certificate that is looked at, where PostgreSQL is on another computer and nothing else is said."""
    url = make_url(database_url)
    told = url.query.get("host") or url.host or ""
    hosts = [one for part in ((told,) if isinstance(told, str) else told) for one in part.split(",") if one]
    here = all(
        host.startswith(("/", "@")) or _is_this_computer(host.partition(":")[0] if host.count(":") == 1 else host)
        for host in hosts
    )
    if url.get_backend_name() != "postgresql" or here or "sslmode" in url.query:
        return database_url
    return url.update_query_dict({"sslmode": "verify-full"}).render_as_string(hide_password=False)


def is_safe(url: object) -> bool:
    """Whether nobody reads along who is between here and there: by TLS, or on this very computer."""
    parts = urlsplit(url) if isinstance(url, str) else None
    if parts is None or not parts.hostname:
        return False
    return parts.scheme == "https" or (parts.scheme == "http" and _is_this_computer(parts.hostname))


def _is_this_computer(host: str) -> bool:
    """A name other than localhost is not trusted to be it."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _parted(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]
