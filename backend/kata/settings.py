"""Settings of the service: command line first, then environment (``KATA_...``), then these defaults."""

from ipaddress import ip_address
from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from platformdirs import user_data_path
from pydantic import Field, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """One object for everything that differs between deployments. What differs between stations is in their TOML."""

    model_config = SettingsConfigDict(env_prefix="KATA_", env_ignore_empty=True, extra="ignore")

    data: Path = Field(default_factory=lambda: user_data_path("kata"))
    """Folder for database, journals and the simulator's files."""
    database_url: str = ""
    """SQLAlchemy's; a SQLite file in the data folder when empty."""
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
    host: str = "127.0.0.1"
    port: int = 8000

    @field_validator("data")
    @classmethod
    def _absolute(cls, data: Path) -> Path:
        return data.absolute()

    @field_validator("clinic_zone")
    @classmethod
    def _known(cls, zone: str) -> str:
        try:
            if zone:
                ZoneInfo(zone)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise ValueError(f"this computer knows no time zone {zone}") from error
        return zone

    @property
    def effective_database_url(self) -> str:
        """What is really opened."""
        return self.database_url or f"sqlite:///{self.data / 'kata.db'}"

    @property
    def is_on_loopback(self) -> bool:
        """Whether only this computer reaches the service; a name other than localhost is not trusted to be it."""
        try:
            return self.host == "localhost" or ip_address(self.host).is_loopback
        except ValueError:
            return False

    @property
    def journal(self) -> Path:
        """Folder of journals."""
        return self.data / "journal"
