"""Defines the commissioning record: person, times, values before and after, and hashes that reveal a later change."""

import glob
import hashlib
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import structs

from kata.device.config import ConfigError, StationConfig, as_toml, decode
from kata.messages import MessageKey
from kata.system.files import replace_file

FORMAT: Final = 1
CHECKED: Final = ("registers", "inputs", "stops", "lags")
"""Steps of the periodic check. A comparison of its lags and frictions with those of the configuration shows drift."""
_NOT_COMMISSIONED: Final[dict[str, Any]] = {"name": "-", "port": "/dev/null", "side": "right"}
"""Fields that may change without a new commissioning, because they do not concern the drives."""


class RecordedValue(msgspec.Struct, frozen=True):
    """One value before and after a step; None if there is none. ``motor``: 1 to 5, or 0 for the station."""

    name: str
    motor: int
    before: int | float | str | None
    after: int | float | str | None


class RecordedCurve(msgspec.Struct, frozen=True):
    """Response of a motor to a step of its setpoint. Angles and times are relative to those before the step."""

    motor: int
    load: str
    """"weight" or "empty"."""
    step_deg: float
    p_gain: int
    i_gain: int
    d_gain: int
    times_s: tuple[float, ...]
    angles_deg: tuple[float, ...]


class RecordedStep(msgspec.Struct, frozen=True):
    """One run of a step. ``fault`` and ``fault_key``: text and key of the fault if the step failed. Times are in ISO 8601, UTC."""

    step: str
    began_at: str
    ended_at: str
    passed: bool
    fault: str = ""
    fault_key: MessageKey | None = None
    values: tuple[RecordedValue, ...] = ()
    curves: tuple[RecordedCurve, ...] = ()
    by: str = ""
    """The person who ran the step, in a periodic check and in a step that was taken over from a former record. Empty in all other steps,
    whose record names the person.
    """


class CommissioningRecord(msgspec.Struct, frozen=True):
    """The record of one commissioning. ``digest`` covers all other fields."""

    station: str
    by: str
    kata: str
    steps: tuple[RecordedStep, ...]
    configuration: str
    """The configuration after the last step, as TOML."""
    configuration_digest: str
    """Digest of the configuration when it was written. It only identifies it; to compare configurations use :func:`has_configuration`."""
    passed: bool = False
    """True when every step has passed and the configuration was written."""
    checks: tuple[RecordedStep, ...] = ()
    """Steps of the periodic checks since the commissioning. They do not change the configuration."""
    previous: str = ""
    """Digest of the previous record; empty for the first record."""
    format: int = FORMAT
    digest: str = ""


class RecordError(ValueError):
    """A record cannot be read, or was changed after it was written."""


def configuration_digest(config: StationConfig) -> str:
    """Return a hash of all fields that commissioning determines. Name, port and side are excluded.

    A later release with additional fields returns another hash for the same configuration. Compare configurations with
    :func:`has_configuration`.
    """
    return _sha256(as_toml(_commissioned_part(config)).encode())


def configuration_of(record: CommissioningRecord) -> StationConfig:
    """Return the configuration of a record. Fields that its release did not have get their default values.

    :raises RecordError: when this release does not accept the configuration.
    """
    try:
        return decode(record.configuration.encode())
    except ConfigError as error:
        raise RecordError(f"the record's configuration cannot be used: {error}") from error


def has_configuration(record: CommissioningRecord, config: StationConfig) -> bool:
    """Return True if the station was commissioned with this configuration. Name, port and side are ignored.

    This release decodes both configurations. A field that was added after the commissioning counts as changed only if the station's file
    sets it to another value than its default.
    """
    try:
        return _commissioned_part(configuration_of(record)) == _commissioned_part(config)
    except RecordError:
        return False


def own_steps(record: CommissioningRecord) -> tuple[RecordedStep, ...]:
    """Return the steps that were not taken over from a former record."""
    return tuple(ran for ran in record.steps if not ran.by)


def sealed(record: CommissioningRecord) -> CommissioningRecord:
    """Return the record with its digest."""
    return structs.replace(record, digest=_digest(msgspec.json.encode(record)))


def read_record(path: Path) -> CommissioningRecord | None:
    """Return a record; None if there is no file.

    :raises RecordError: when the record cannot be read or does not match its digest.
    """
    try:
        data = path.read_bytes()
        record = msgspec.json.decode(data, type=CommissioningRecord)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError) as error:
        raise RecordError(f"{path} cannot be read: {error}") from error
    if record.digest != _digest(data):
        raise RecordError(f"{path} was changed after it was written")
    return record


def readable_record(path: Path) -> CommissioningRecord | None:
    """Return the record; None if it is missing or cannot be used."""
    try:
        return read_record(path)
    except RecordError:
        return None


def write_record(record: CommissioningRecord, path: Path) -> None:
    """Write a record. The file is replaced atomically."""
    replace_file(path, msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n")


def record_path(station: Path) -> Path:
    """Return the path of the record beside a station's file."""
    return station.with_suffix(".commissioning.json")


def record_paths(station: Path) -> list[Path]:
    """Return the paths of the records beside a station's file, oldest first."""
    present = record_path(station)
    former = sorted(station.parent.glob(f"{glob.escape(station.stem)}.commissioning.*.json"))
    return [*former, *([present] if present.exists() else [])]


def _digest(data: bytes) -> str:
    """Return the hash of a record as JSON. It covers only the fields that the record has, so that a record of an earlier
    release keeps its hash.
    """
    fields = msgspec.json.decode(data)
    return _sha256(msgspec.json.encode(fields | {"digest": ""}))


def _commissioned_part(config: StationConfig) -> StationConfig:
    return structs.replace(config, **_NOT_COMMISSIONED)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
