"""Routes to read the station's commissioning status, and to read, compare and import its configuration."""

from datetime import datetime
from pathlib import Path
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query, Request
from pydantic import Field, StringConstraints

from kata import __version__
from kata.api import texts
from kata.api.services import Services, services_of
from kata.clinic.stations import service as station_service
from kata.commissioning.record import has_configuration, readable_record, record_path
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.device import config
from kata.device.config_fields import changes_between, fields_of
from kata.errors import ProblemError
from kata.station.schemas import OptionalKey, TextKey
from kata.system.files import replace_file
from kata.types import NO_NUL, Schema

router = APIRouter(tags=["commissioning"])

_LONGEST_FILE: Final = 100_000
State = Literal["not_needed", "commissioned", "due", "not_commissioned"]


class CommissioningState(Schema):
    """Commissioning state of the station."""

    state: State = Field(description="not_needed: the apparatus is simulated. due: the periodic check is due.")
    reason: str = Field(description="Why the station is not commissioned, else empty.")
    reason_key: OptionalKey = None
    commissioned_at: datetime | None
    due_at: datetime | None = Field(description="When the next periodic check is due.")


class AcceptedValues(Schema):
    """The values that are allowed for a field, in the field's unit."""

    low: float
    high: float
    choices: list[float] = Field(description="The only allowed values; empty: every value from low to high is allowed.")
    step: int | None = Field(description="Only multiples of this number are allowed.")
    none: int | None = Field(description="An additional value that means `none`.")


class SettingField(Schema):
    """A field of a station's configuration."""

    name: str = Field(examples=["axes[1].max_torque_nm"])
    value: str
    unit: str
    accepted: AcceptedValues | None = Field(description="Null for a text.")


class StationSettings(Schema):
    """One version of a station's configuration, field by field."""

    number: int = Field(ge=1)
    fields: list[SettingField]


class SettingChange(Schema):
    """A field that differs between two configurations."""

    name: str
    unit: str
    before: str
    after: str


class StationFile(Schema):
    """The content of a station's file."""

    config: Annotated[str, StringConstraints(min_length=1, max_length=_LONGEST_FILE, pattern=NO_NUL)] = Field(
        description="TOML."
    )


class SettingsPreview(Schema):
    """Changes that an import would make."""

    changes: list[SettingChange]
    recommission: bool = Field(description="True if the station must be commissioned again with this configuration.")


@router.get("/api/station/commissioning", summary="Get whether the station is commissioned")
def get_commissioning_status(request: Request) -> CommissioningState:
    """Return whether this station is commissioned, and when the periodic check is due. The answer comes from the station's computer
    instead of the database.
    """
    status = services_of(request).commissioning.status
    if status is None:
        return CommissioningState(state="not_needed", reason="", commissioned_at=None, due_at=None)
    if status.missing is not None:
        return CommissioningState(
            state="not_commissioned",
            reason=status.missing,
            reason_key=TextKey.of(status.missing),
            commissioned_at=None,
            due_at=None,
        )
    is_due = status.due_at is not None and status.due_at <= utc_now()
    return CommissioningState(
        state="due" if is_due else "commissioned",
        reason="",
        commissioned_at=status.commissioned_at,
        due_at=status.due_at,
    )


@router.get("/api/station-settings", responses=PROBLEMS.of(404, 422), summary="Get a station's configuration by field")
def get_station_settings(
    database: TheDatabase,
    station: Annotated[str, Query(max_length=100, description="Name of the station.")],
    number: Annotated[int | None, Query(ge=1, le=1_000_000, description="The version; the newest by default.")] = None,
) -> StationSettings:
    """Return a version of a station's configuration with the unit and the accepted range of each field."""
    with database.read() as session:
        row = station_service.version(session, station, number)
    try:
        decoded = config.decode(row.config.encode())
    except config.ConfigError as error:
        raise ProblemError(409, "settings_unreadable", texts.SETTINGS_UNREADABLE(number=row.number)) from error
    return StationSettings(
        number=row.number, fields=[SettingField.model_validate(field) for field in fields_of(decoded)]
    )


@router.post(
    "/api/station/configuration/preview",
    responses=PROBLEMS.of(409, 422),
    summary="Check a station's file before its import",
)
def preview_station_settings(request: Request, body: StationFile) -> SettingsPreview:
    """Check a station's file and return what it would change. Nothing is stored."""
    services = services_of(request)
    imported, present, file = _read_imported(services, body)
    changes = [SettingChange.model_validate(change) for change in changes_between(present, imported)]
    return SettingsPreview(changes=changes, recommission=_needs_commissioning(services, imported, file))


@router.put(
    "/api/station/configuration", responses=PROBLEMS.of(409, 422), summary="Import a station's file", status_code=200
)
def import_station_settings(
    request: Request, database: TheDatabase, actor: TheActor, body: StationFile
) -> SettingsPreview:
    """Replace the station's file and return the changes. The service uses the new file after its next start."""
    services = services_of(request)
    imported, present, file = _read_imported(services, body)
    with database.write() as session:
        station_service.register(
            session, imported, __version__, utc_now(), simulated=services.settings.simulate, changed_by=actor.name
        )
        _replace(file, imported)
    changes = [SettingChange.model_validate(change) for change in changes_between(present, imported)]
    return SettingsPreview(changes=changes, recommission=_needs_commissioning(services, imported, file))


def _read_imported(
    services: Services, station_file: StationFile
) -> tuple[config.StationConfig, config.StationConfig, Path]:
    """Return the given configuration, the present one, and the path of the station's file.

    :raises ProblemError: 409 when the service has no file; 422 with each invalid field, its value and its range.
    """
    file = services.settings.station
    if file is None:
        raise ProblemError(409, "no_station_file", texts.NO_STATION_FILE(), texts.START_WITH_STATION_FILE())
    try:
        imported = config.decode(station_file.config.encode())
    except config.ConfigError as error:
        message = texts.SETTINGS_INVALID(problems=str(error))
        raise ProblemError(422, "settings_invalid", message, texts.CORRECT_STATION_FILE()) from error
    if imported.name != services.station_name:
        message = texts.OTHER_STATIONS_FILE(given=imported.name, station=services.station_name)
        raise ProblemError(422, "other_stations_file", message, texts.CORRECT_STATION_FILE())
    try:
        return imported, config.read(file), file
    except config.ConfigError as error:
        raise ProblemError(409, "no_station_file", texts.NO_STATION_FILE(), texts.START_WITH_STATION_FILE()) from error


def _needs_commissioning(services: Services, imported: config.StationConfig, file: Path) -> bool:
    if services.settings.simulate:
        return False
    record = readable_record(record_path(file))
    return record is None or not record.passed or not has_configuration(record, imported)


def _replace(file: Path, imported: config.StationConfig) -> None:
    """Replace the station's file atomically.

    :raises ProblemError: 409 when it cannot be written.
    """
    try:
        replace_file(file, config.as_toml(imported).encode())
    except OSError as error:
        message = texts.STATION_FILE_NOT_WRITTEN(reason=error.strerror or "")
        raise ProblemError(409, "station_file_not_written", message, texts.COPY_STATION_FILE()) from error
