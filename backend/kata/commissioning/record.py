"""Defines the commissioning record: person, times, values before and after, and signatures that reveal a later change.

A digest identifies a record. The station signs the digest of the record and of each of its parts: the commissioning without checks, and each
periodic check. The database stores the parts.
"""

import glob
import hashlib
import os
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from msgspec import structs

from kata.commissioning.signature import KeyFileError, is_signature, load_key, public_key_of, sign, store_key
from kata.device.config import ConfigError, StationConfig, as_toml, decode
from kata.messages import MessageKey
from kata.system.files import replace_file

FORMAT: Final = 1
CHECKED: Final = ("registers", "inputs", "stops", "lags")
"""Steps of the periodic check. A comparison of its lags and frictions with those of the configuration shows drift."""
_FREE_FIELDS: Final[dict[str, Any]] = {"name": "-", "port": "/dev/null", "side": "right"}
"""Fields that may change without a new commissioning, because they do not concern the drives."""
_OF_SIGNATURE: Final = frozenset({"public_key", "signatures"})
"""Fields that a digest does not cover, besides itself."""
_SUFFIX: Final = ".commissioning.json"

SignatureState = Literal["valid", "invalid", "unsigned"]


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
    """The record of one commissioning. ``digest`` covers all other fields but ``public_key`` and ``signatures``."""

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
    public_key: str = ""
    """Public part of the key that has signed the record. Empty: a record of an earlier release, which is not signed."""
    signatures: dict[str, str] = {}
    """The signatures of the record and its parts, by their digests."""


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
    """Return the record with its digest, not signed yet."""
    return structs.replace(record, digest=_digest(msgspec.json.encode(record)), public_key="", signatures={})


def commissioning_part(record: CommissioningRecord) -> CommissioningRecord:
    """Return the record without periodic checks, with its own signature."""
    return _part(record, structs.replace(record, checks=()))


def check_parts(record: CommissioningRecord) -> Iterator[CommissioningRecord]:
    """Yield a record of each periodic check, with its own signature. A check begins with the first of its steps."""
    number = 0

    def check_of(step: RecordedStep) -> int:
        nonlocal number
        number += step.step == CHECKED[0]
        return number

    for _, steps in groupby(record.checks, check_of):
        yield _part(record, structs.replace(record, steps=(), checks=tuple(steps)))


def _part(record: CommissioningRecord, part: CommissioningRecord) -> CommissioningRecord:
    part = sealed(part)
    if part.digest not in record.signatures:
        # The record is not signed, or an earlier release, with other fields, has signed it.
        return part
    signatures = {part.digest: record.signatures[part.digest]}
    return structs.replace(part, public_key=record.public_key, signatures=signatures)


def signature_state(data: bytes) -> SignatureState:
    """Return whether a record, as stored JSON, is as the owner of its key has signed it."""
    record = msgspec.json.decode(data, type=CommissioningRecord)
    if record.digest != _digest(data):
        return "invalid"
    if not record.public_key and not record.signatures:
        return "unsigned"
    signature = record.signatures.get(record.digest, "")
    return "valid" if is_signature(record.public_key, signature, record.digest) else "invalid"


def read_record(path: Path) -> CommissioningRecord | None:
    """Return a record; None if there is no file.

    :raises RecordError: when the record cannot be read, was changed, or was not signed by this station.
    """
    try:
        data = path.read_bytes()
        record = msgspec.json.decode(data, type=CommissioningRecord)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError) as error:
        raise RecordError(f"{path} cannot be read: {error}") from error
    if signature_state(data) == "invalid":
        raise RecordError(f"{path} was changed after it was written")
    if path.name.endswith(_SUFFIX):
        _check_key(record, path)
    return record


def _check_key(record: CommissioningRecord, path: Path) -> None:
    """Compare the key of the station's present record with the station's key.

    Without the key's file the record's own key counts: the station's file and record may have been moved to another computer.

    :raises RecordError: when the keys differ, or the record is not signed although there is a key.
    """
    file = key_path(path)
    if not file.exists():
        return
    if not record.public_key:
        raise RecordError(f"{path} is not signed, but this station signs its records with {file}")
    try:
        key = load_key(file)
    except KeyFileError:
        # The service may not be allowed to read the key of another user.
        return
    if key and public_key_of(key) != record.public_key:
        raise RecordError(f"{path} is not signed with this station's key {file}")


def readable_record(path: Path) -> CommissioningRecord | None:
    """Return the record; None if it is missing or cannot be used."""
    try:
        return read_record(path)
    except RecordError:
        return None


def write_record(record: CommissioningRecord, path: Path) -> CommissioningRecord:
    """Sign a record with the station's key and write it. Return the signed record. The file is replaced atomically. The first record makes
    the key.

    :raises KeyFileError: when the key cannot be used.
    """
    key_file = key_path(path)
    known_key = load_key(key_file)
    key = known_key or Ed25519PrivateKey.generate()
    digests = [part.digest for part in (record, commissioning_part(record), *check_parts(record))]
    signatures = {digest: sign(key, digest) for digest in digests}
    signed = structs.replace(record, public_key=public_key_of(key), signatures=signatures)
    replace_file(path, msgspec.json.format(msgspec.json.encode(signed), indent=1) + b"\n")
    if known_key is None:
        # The key is stored after the record, because a record that is not signed with the stored key is refused.
        store_key(key, key_file)
    return signed


def writing_problem(station: Path) -> str | None:
    """Return why this user could not sign or write the record of a station; None if it is possible."""
    folder = station.absolute().parent
    try:
        load_key(key_path(record_path(station)))
    except KeyFileError as error:
        return str(error)
    return None if os.access(folder, os.W_OK) else f"this user may not write to {folder}"


def key_path(record: Path) -> Path:
    """Return the path of the station's key beside its present record."""
    return record.with_name(f"{record.name.removesuffix(_SUFFIX)}.commissioning-key.pem")


def record_path(station: Path) -> Path:
    """Return the path of the record beside a station's file."""
    return station.with_suffix(_SUFFIX)


def record_paths(station: Path) -> list[Path]:
    """Return the paths of the records beside a station's file, oldest first."""
    present = record_path(station)
    former = sorted(station.parent.glob(f"{glob.escape(station.stem)}.commissioning.*.json"))
    return [*former, *([present] if present.exists() else [])]


def _digest(data: bytes) -> str:
    """Return the hash of a record as JSON. It covers only the fields that the record has, so that a record of an earlier
    release keeps its hash.
    """
    fields = {name: value for name, value in msgspec.json.decode(data).items() if name not in _OF_SIGNATURE}
    return _sha256(msgspec.json.encode(fields | {"digest": ""}))


def _commissioned_part(config: StationConfig) -> StationConfig:
    return structs.replace(config, **_FREE_FIELDS)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
